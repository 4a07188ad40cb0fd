#include "localize/run_recorder.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <utility>

namespace vantage {
namespace {

using io::ros::Diagnostic;
using io::ros::Header;

constexpr const char* kMapFrame = "map";
constexpr const char* kScanFrame = "lidar";
constexpr const char* kNoMaps = "the bundle holds prepared maps only, no points";
constexpr double kDegrees = 180.0 / M_PI;
// float32 is exact to 1 mm up to 16 km.
constexpr double kFarFromOrigin = 10'000.0;

/// The middle of a map that is too far from its origin for float32, in whole metres; otherwise
/// zero.
Point origin_of(const Bounds3& bounds) {
  if (bounds.empty()) return Point::Zero();
  const Point farthest = bounds.min.cwiseAbs().cwiseMax(bounds.max.cwiseAbs());
  if (farthest.maxCoeff() < kFarFromOrigin) return Point::Zero();
  return (0.5 * (bounds.min + bounds.max)).array().round() + 0.0;  // no -0
}

std::string text_of(const Point& p) { return fmt::format("{} {} {}", p.x(), p.y(), p.z()); }

/// Names and values, for those values that exist.
class Values {
 public:
  void add(const std::string& name, const std::string& value) { values_.emplace_back(name, value); }
  void add(const std::string& name, double value) { add(name, fmt::format("{}", value)); }
  void add(const std::string& name, std::size_t value) { add(name, std::to_string(value)); }
  void add(const std::string& name, bool value) { add(name, std::string(value ? "yes" : "no")); }
  [[nodiscard]] std::vector<std::pair<std::string, std::string>> take() && {
    return std::move(values_);
  }

 private:
  std::vector<std::pair<std::string, std::string>> values_;
};

void add_state(Values& values, const ScanReport& report) {
  values.add("tracking", std::string(to_string(report.tracking)));
  values.add("reason", report.reason);
  values.add("has_pose", report.has_pose);
  values.add("recovered", report.recovered);
  values.add("switched", report.switched);
  values.add("outside", report.outside);
  values.add("blocked", report.blocked);
}

void add_times(Values& values, const ScanReport& report) {
  values.add("align_ms", 1e3 * report.seconds_align);
  values.add("search_ms", 1e3 * report.seconds_search);
  values.add("stall_ms", 1e3 * report.seconds_stall);
  values.add("load_ms", 1e3 * report.seconds_load);
  values.add("prepare_ms", 1e3 * report.seconds_prepare);
}

void add_scores(Values& values, const ScanReport& report) {
  values.add("map_points", report.map_points);
  values.add("scan_points", report.scan_points);
  if (const auto& alignment = report.alignment) {
    values.add("iterations", std::size_t{alignment->iterations});
    values.add("termination", std::string(to_string(alignment->termination)));
    values.add("fitness", alignment->score.fitness);
    values.add("nvtl", alignment->score.nvtl);
    values.add("coverage", alignment->score.coverage);
    values.add("lcp", report.lcp);
  }
  if (const auto& confidence = report.confidence) {
    values.add("sigma_m", confidence->sigma_translation[0]);
    values.add("sigma_deg", confidence->sigma_rotation[0] * kDegrees);
    values.add("degenerate", std::size_t{confidence->degenerate});
  }
}

Diagnostic::Level level_of(const ScanReport& report) {
  if (report.tracking == Tracking::tracked) return Diagnostic::Level::ok;
  return report.has_pose ? Diagnostic::Level::warn : Diagnostic::Level::error;
}

}  // namespace

RunRecorder::RunRecorder(std::string name, io::ros::McapWriter writer, PluginPtr<MapStore> store,
                         MapIndex index)
    : name_(std::move(name)),
      writer_(std::move(writer)),
      store_(std::move(store)),
      index_(std::move(index)),
      origin_(origin_of(index_.map_bounds)),
      has_maps_(std::any_of(index_.regions.begin(), index_.regions.end(),
                            [](const RegionSummary& region) { return region.points > 0; })) {}

Result<RunRecorder> RunRecorder::create(const std::filesystem::path& path, const Config& config,
                                        const PluginLoader& loader) {
  VANTAGE_TRY(const StoreConfig choice, config.need(config.store, "store", "recording"));
  VANTAGE_TRY(auto store, loader.load<MapStore>(choice.choice()));
  VANTAGE_TRY(auto index, store->index());
  std::error_code ignored;  // creating the file reports what is wrong
  if (path.has_parent_path()) std::filesystem::create_directories(path.parent_path(), ignored);
  VANTAGE_TRY(auto writer, io::ros::McapWriter::create(path));
  RunRecorder recorder(path.string(), std::move(writer), std::move(store), std::move(index));
  VANTAGE_CHECK(recorder.describe(config));
  return recorder;
}

Result<void> RunRecorder::describe(const Config& config) {
  VANTAGE_CHECK(writer_.add_metadata("vantage", {{"config", config.file},
                                                 {"origin_x", fmt::format("{}", origin_.x())},
                                                 {"origin_y", fmt::format("{}", origin_.y())},
                                                 {"origin_z", fmt::format("{}", origin_.z())},
                                                 {"map", has_maps_ ? "/map" : kNoMaps}}));
  const auto add = [&](auto& channel, const char* topic, const char* type) -> Result<void> {
    VANTAGE_TRY(const auto schema, io::ros::schema_of(type));
    VANTAGE_TRY(channel, writer_.add_channel(topic, schema));
    return {};
  };
  if (has_maps_) VANTAGE_CHECK(add(channels_.map, "/map", "sensor_msgs/PointCloud2"));
  VANTAGE_CHECK(add(channels_.scan, "/scan", "sensor_msgs/PointCloud2"));
  VANTAGE_CHECK(add(channels_.pose, "/pose", "geometry_msgs/PoseStamped"));
  VANTAGE_CHECK(add(channels_.region, "/region", "std_msgs/String"));
  VANTAGE_CHECK(add(channels_.tf, "/tf", "tf2_msgs/TFMessage"));
  return add(channels_.diagnostics, "/diagnostics", "diagnostic_msgs/DiagnosticArray");
}

Result<void> RunRecorder::add(const io::StampedScan& scan, const RunScan& result) {
  const ScanReport& report = result.report;
  if (report.has_pose) {
    if (has_maps_ && shown_ != report.region) {
      VANTAGE_CHECK(add_map(scan.stamp, report.region));
    }
    VANTAGE_CHECK(add_pose(report));
  }
  VANTAGE_CHECK(add_scan(scan));
  VANTAGE_CHECK(add_diagnostics(result));
  ++scans_;
  return {};
}

Result<void> RunRecorder::add_map(double stamp, RegionId region) {
  VANTAGE_TRY(RegionMap map, store_->get(region));
  for (Point& p : map.points) p -= origin_;
  VANTAGE_TRY(const auto message,
              io::ros::write_point_cloud2({.stamp = stamp, .frame = kMapFrame}, map.points));
  shown_ = region;
  ++maps_;
  return writer_.write(channels_.map, stamp, message);
}

Result<void> RunRecorder::add_scan(const io::StampedScan& scan) {
  std::vector<io::ros::CloudField> more;
  if (!scan.seconds.empty()) more.push_back({.name = "time", .values = scan.seconds});
  VANTAGE_TRY(
      const auto message,
      io::ros::write_point_cloud2({.stamp = scan.stamp, .frame = kScanFrame}, scan.points, more));
  return writer_.write(channels_.scan, scan.stamp, message);
}

Result<void> RunRecorder::add_pose(const ScanReport& report) {
  const Header header{.stamp = report.stamp, .frame = kMapFrame};
  Pose pose = report.T_map_scan;
  pose.translation -= origin_;
  const std::array transforms{
      io::ros::PoseMessage{.header = header, .child = kScanFrame, .pose = pose, .problem = {}}};
  VANTAGE_TRY(const auto tf, io::ros::write_transforms(transforms));
  VANTAGE_CHECK(writer_.write(channels_.tf, report.stamp, tf));
  VANTAGE_TRY(const auto stamped, io::ros::write_pose_stamped(header, pose));
  VANTAGE_CHECK(writer_.write(channels_.pose, report.stamp, stamped));
  VANTAGE_TRY(const auto label, io::ros::write_string(index_.partition[report.region].label));
  return writer_.write(channels_.region, report.stamp, label);
}

Result<void> RunRecorder::add_diagnostics(const RunScan& result) {
  const ScanReport& report = result.report;
  Values values;
  add_state(values, report);
  add_times(values, report);
  add_scores(values, report);
  values.add("dropped_points",
             static_cast<std::size_t>(report.dropped_points + result.dropped_by_reader));
  if (result.error) {
    values.add("error_m", result.error->metres);
    values.add("error_deg", result.error->degrees);
  }
  values.add("origin_m", text_of(origin_));
  if (!has_maps_) values.add("map", std::string(kNoMaps));
  const bool tracked = report.tracking == Tracking::tracked;
  const std::array diagnostics{Diagnostic{.level = level_of(report),
                                          .name = "vantage: localization",
                                          .message = tracked ? "tracked" : report.reason,
                                          .values = std::move(values).take()}};
  VANTAGE_TRY(const auto message,
              io::ros::write_diagnostics({.stamp = report.stamp, .frame = kMapFrame}, diagnostics));
  return writer_.write(channels_.diagnostics, report.stamp, message);
}

Result<void> RunRecorder::commit() { return writer_.commit(); }

std::string RunRecorder::summary() const {
  std::string line = fmt::format("recorded in {}: {} scans, ", name_, scans_);
  line += has_maps_ ? fmt::format("{} region map{}", maps_, maps_ == 1 ? "" : "s")
                    : fmt::format("no region maps ({})", kNoMaps);
  if (!origin_.isZero(0.0))
    line += fmt::format("; {} m subtracted from all places", text_of(origin_));
  return line;
}

}  // namespace vantage
