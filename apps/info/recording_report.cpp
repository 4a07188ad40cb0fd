#include "info/recording_info.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <nlohmann/json.hpp>

#include "checks/notes.hpp"
#include "info/lines.hpp"
#include "info/map_lines.hpp"
#include "io/formats.hpp"
#include "terminal/table.hpp"

namespace vantage {
namespace {

double share_of_dropped(const PointsInfo& points) {
  const auto all = static_cast<double>(points.finite + points.dropped);
  return all > 0.0 ? static_cast<double>(points.dropped) / all : 0.0;
}

void add_points(Lines& lines, const PointsInfo& points) {
  lines.emplace_back("NaN or infinite", fmt::format("{} ({:.2f} %)", cli::grouped(points.dropped),
                                                    100.0 * share_of_dropped(points)));
  lines.emplace_back("extent [m]", box_text(points.extent));
}

std::string vector_text(const Eigen::Vector3d& v, int digits) {
  return fmt::format("{:.{}f}, {:.{}f}, {:.{}f}", v.x(), digits, v.y(), digits, v.z(), digits);
}

/// When samples were measured, seen from the scans.
struct TimeOffset {
  double begins_before = 0.0, ends_after = 0.0;  // [s]
  bool overlaps = false;
};

TimeOffset offset_of(const io::ImuRecording& imu, const ScansInfo& scans) {
  const double first = imu.samples.front().stamp, last = imu.samples.back().stamp;
  return {.begins_before = scans.first - first,
          .ends_after = last - scans.last,
          .overlaps = first <= scans.last && last >= scans.first};
}

std::string offset_text(const io::ImuRecording& imu, const std::optional<ScansInfo>& scans) {
  if (!scans || scans->count == 0) return "";
  const TimeOffset offset = offset_of(imu, *scans);
  if (!offset.overlaps) {
    return fmt::format("; not at the time of the scans, {:.6f} to {:.6f}", scans->first,
                       scans->last);
  }
  const auto side = [](double seconds, std::string_view before, std::string_view after) {
    return fmt::format("{:.3f} s {}", std::abs(seconds), seconds >= 0.0 ? before : after);
  };
  return fmt::format("; begins {} the scans, ends {} them",
                     side(offset.begins_before, "before", "after"),
                     side(offset.ends_after, "after", "before"));
}

Lines lines_of(const ImuInfo& info, const std::optional<ScansInfo>& scans) {
  Lines lines;
  if (!info.topic.empty()) lines.emplace_back("IMU", info.topic);
  if (!info.recording) {
    lines.emplace_back("IMU samples", info.problem);
    return lines;
  }
  const io::ImuRecording& imu = *info.recording;
  if (!imu.frame.empty()) lines.emplace_back("IMU frame", imu.frame);
  lines.emplace_back("IMU samples", cli::grouped(imu.samples.size()));
  if (imu.not_finite + imu.duplicates + imu.out_of_order > 0) {
    lines.emplace_back("IMU irregular",
                       fmt::format("{} left out without a number or a stamp, {} with the stamp of "
                                   "another one, {} sorted in that came late",
                                   cli::grouped(imu.not_finite), cli::grouped(imu.duplicates),
                                   cli::grouped(imu.out_of_order)));
  }
  lines.emplace_back("IMU rate [Hz]", fmt::format("{:.3f}", imu.rate_hz));
  lines.emplace_back("IMU stamps", imu.stamp_rule);
  lines.emplace_back("IMU first, last [s]",
                     fmt::format("{:.6f}, {:.6f}{}", imu.samples.front().stamp,
                                 imu.samples.back().stamp, offset_text(imu, scans)));
  lines.emplace_back("IMU acceleration", fmt::format("in {}: {:.3f} while it moves least",
                                                     to_string(imu.unit), imu.still_force));
  if (!imu.rest) {
    lines.emplace_back("IMU at rest", "not at the beginning");
    return lines;
  }
  lines.emplace_back("IMU at rest", fmt::format("for the first {:.1f} s", imu.rest->seconds));
  lines.emplace_back(
      "IMU gravity",
      fmt::format("along {}, {:.3f} m/s^2", vector_text(imu.rest->gravity, 3), imu.rest->force));
  lines.emplace_back("IMU gyro bias [rad/s]", vector_text(imu.rest->gyro_bias, 5));
  return lines;
}

Lines lines_of(const ScansInfo& scans) {
  Lines lines;
  const io::ScanDescription& d = scans.description;
  if (!d.topic.empty()) lines.emplace_back("scans of", d.topic);
  if (!d.frame.empty()) lines.emplace_back("frame", d.frame);
  lines.emplace_back("scans", cli::grouped(scans.count));
  if (scans.skipped.total() > 0) {
    lines.emplace_back("skipped",
                       fmt::format("{} stamped no later than the one before, {}",
                                   cli::grouped(scans.skipped.not_later),
                                   cli::counted(scans.skipped.incomplete, "incomplete sweep")));
  }
  lines.emplace_back("stamps", d.stamp_rule);
  lines.emplace_back("first, last [s]", fmt::format("{:.6f}, {:.6f}", scans.first, scans.last));
  lines.emplace_back("duration [s]", fmt::format("{:.3f}", scans.last - scans.first));
  if (scans.interval > 0.0) {
    lines.emplace_back("rate [Hz]", fmt::format("{:.3f}", 1.0 / scans.interval));
    std::string gaps = cli::grouped(scans.gaps.size());
    if (!scans.gaps.empty()) {
      const auto longest =
          std::max_element(scans.gaps.begin(), scans.gaps.end(),
                           [](const Gap& a, const Gap& b) { return a.seconds < b.seconds; });
      gaps += fmt::format(", the longest {:.3f} s after {:.6f}", longest->seconds, longest->after);
    }
    lines.emplace_back("gaps", gaps);
  }
  if (!d.fields.empty()) lines.emplace_back("fields", fmt::format("{}", fmt::join(d.fields, ", ")));
  const std::uint64_t mean = scans.count > 0 ? scans.points.finite / scans.count : 0;
  lines.emplace_back("points a scan",
                     fmt::format("{} ({} to {})", cli::grouped(mean), cli::grouped(scans.fewest),
                                 cli::grouped(scans.most)));
  lines.emplace_back("times of points",
                     scans.with_times == 0
                         ? "none"
                         : fmt::format("in {}, over {:.4f} s at most",
                                       cli::counted(scans.with_times, "scan"), scans.sweep));
  if (scans.no_returns > 0) {
    lines.emplace_back("no returns", fmt::format("{} at 0, 0, 0, left out",
                                                 cli::counted(scans.no_returns, "point")));
  }
  add_points(lines, scans.points);
  return lines;
}

nlohmann::ordered_json json_of(const PointsInfo& points) {
  nlohmann::ordered_json json{{"finite", points.finite},
                              {"not_finite", points.dropped},
                              {"share_not_finite", share_of_dropped(points)},
                              {"min", nullptr},
                              {"max", nullptr}};
  if (!points.extent.isEmpty()) {
    json["min"] = vector_json(points.extent.min());
    json["max"] = vector_json(points.extent.max());
  }
  return json;
}

nlohmann::ordered_json json_of(const ImuInfo& info, const std::optional<ScansInfo>& scans) {
  nlohmann::ordered_json json{{"topic", info.topic}};
  if (!info.recording) {
    json["problem"] = info.problem;
    return json;
  }
  const io::ImuRecording& imu = *info.recording;
  json.update({{"frame", imu.frame},
               {"count", imu.samples.size()},
               {"not_finite", imu.not_finite},
               {"duplicates", imu.duplicates},
               {"out_of_order", imu.out_of_order},
               {"rate", imu.rate_hz},
               {"stamps", imu.stamp_rule},
               {"first_stamp", imu.samples.front().stamp},
               {"last_stamp", imu.samples.back().stamp},
               {"unit", to_string(imu.unit)},
               {"still_norm", imu.still_force},
               {"rest", nullptr}});
  if (imu.rest) {
    json["rest"] = {{"seconds", imu.rest->seconds},
                    {"gravity_direction", vector_json(imu.rest->gravity)},
                    {"gravity", imu.rest->force},
                    {"gyro_bias", vector_json(imu.rest->gyro_bias)}};
  }
  if (scans && scans->count > 0) {
    const TimeOffset offset = offset_of(imu, *scans);
    json["begins_before_scans"] = offset.begins_before;
    json["ends_after_scans"] = offset.ends_after;
    json["overlaps_scans"] = offset.overlaps;
  }
  return json;
}

nlohmann::ordered_json json_of(const ScansInfo& scans) {
  nlohmann::ordered_json gaps = nlohmann::ordered_json::array();
  for (const Gap& gap : scans.gaps) {
    gaps.push_back({{"after", gap.after}, {"seconds", gap.seconds}});
  }
  return {{"topic", scans.description.topic},
          {"frame", scans.description.frame},
          {"fields", scans.description.fields},
          {"stamps", scans.description.stamp_rule},
          {"count", scans.count},
          {"skipped",
           {{"not_later", scans.skipped.not_later}, {"incomplete", scans.skipped.incomplete}}},
          {"first_stamp", scans.first},
          {"last_stamp", scans.last},
          {"duration", scans.last - scans.first},
          {"interval", scans.interval},
          {"gaps", std::move(gaps)},
          {"with_point_times", scans.with_times},
          {"no_returns", scans.no_returns},
          {"sweep", scans.sweep},
          {"fewest_points", scans.fewest},
          {"most_points", scans.most},
          {"points", json_of(scans.points)}};
}

}  // namespace

std::string formats_text(const cli::Style& style) {
  cli::TextTable table({"format", "names", "read as", "variants"}, 4);
  for (const io::FormatDescription& format : io::formats()) {
    std::vector<std::string_view> uses;
    for (const io::FormatUse use : format.uses) uses.push_back(io::to_string(use));
    table.add(
        {std::string(format.name),
         format.extensions.empty() ? "any" : fmt::format("{}", fmt::join(format.extensions, " ")),
         uses.empty() ? "-" : fmt::format("{}", fmt::join(uses, ", ")), std::string(format.help)});
  }
  return table.to_string(style);
}

std::string to_text(const RecordingInfo& info, const cli::Style& style) {
  Lines lines{{"path", info.path.string()},
              {"format", info.format},
              {"size [MB]", fmt::format("{:.2f}", static_cast<double>(info.bytes) / 1e6)}};
  if (info.scans) {
    for (auto& line : lines_of(*info.scans)) lines.push_back(std::move(line));
  }
  if (info.map) {
    lines.emplace_back("fields", fmt::format("{}", fmt::join(info.map_fields, ", ")));
    lines.emplace_back("points", cli::grouped(info.map->finite));
    add_points(lines, *info.map);
  }
  if (info.map_facts) {
    for (auto& line : map_lines(*info.map_facts)) lines.push_back(std::move(line));
    for (const checks::Note& note : notes_on(*info.map_facts)) {
      lines.emplace_back("note", note.what + ": " + note.advice);
    }
  }
  if (!info.no_scans.empty()) lines.emplace_back("scans", info.no_scans);
  for (const ImuInfo& imu : info.imus) {
    for (auto& line : lines_of(imu, info.scans)) lines.push_back(std::move(line));
  }
  std::string text = to_text(lines, style);
  if (info.topics.empty()) return text;
  cli::TextTable table({"topic", "type", "messages"}, 2);
  for (const io::ros::Topic& topic : info.topics) {
    table.add({cli::one_line(topic.name), cli::one_line(topic.type),
               topic.messages ? cli::grouped(*topic.messages) : "?"});
  }
  return text + '\n' + table.to_string(style);
}

nlohmann::ordered_json to_json(const RecordingInfo& info) {
  nlohmann::ordered_json json{
      {"path", info.path.string()}, {"format", info.format}, {"bytes", info.bytes}};
  if (!info.topics.empty()) {
    json["topics"] = nlohmann::ordered_json::array();
    for (const io::ros::Topic& topic : info.topics) {
      nlohmann::ordered_json entry{
          {"name", topic.name}, {"type", topic.type}, {"messages", nullptr}};
      if (topic.messages) entry["messages"] = *topic.messages;
      json["topics"].push_back(std::move(entry));
    }
  }
  if (info.scans) json["scans"] = json_of(*info.scans);
  if (info.map) {
    json["map"] = json_of(*info.map);
    json["map"]["files"] = info.map_files.size();
    json["map"]["fields"] = info.map_fields;
  }
  if (info.map_facts) {
    for (const auto& [name, value] : map_lines(*info.map_facts)) json["measured"][name] = value;
    if (const auto notes = notes_on(*info.map_facts); !notes.empty()) {
      json["notes"] = checks::to_json(notes);
    }
  }
  if (!info.no_scans.empty()) json["no_scans"] = info.no_scans;
  if (info.damage) json["damage"] = to_string(*info.damage);
  if (!info.imus.empty()) {
    json["imu"] = nlohmann::ordered_json::array();
    for (const ImuInfo& imu : info.imus) json["imu"].push_back(json_of(imu, info.scans));
  }
  return json;
}

}  // namespace vantage
