#include "localize/run_recorder.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <utility>

#include "foxglove/layout.hpp"
#include "live/diagnostics.hpp"
#include "localize/run_topics.hpp"
#include "terminal/counts.hpp"
#include "vantage/evaluation/metrics.hpp"

namespace vantage {
namespace {

using io::ros::Diagnostic;
using io::ros::Header;

constexpr const char* kNoMaps = "the bundle holds prepared maps only, no points";
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
  [[nodiscard]] std::vector<std::pair<std::string, std::string>> take() && {
    return std::move(values_);
  }

 private:
  std::vector<std::pair<std::string, std::string>> values_;
};

void add_state(Values& values, const ScanReport& report) {
  values.add("tracking", std::string(to_string(report.tracking)));
  values.add("reason", report.reason);
  values.add("has_pose", std::string(report.has_pose ? "yes" : "no"));
  if (report.alignment) {
    values.add("termination", std::string(to_string(report.alignment->termination)));
  }
}

void add_metrics(Values& values, const RunScan& scan) {
  for (const Metric& metric : metrics()) {
    if (metric.is(kNotInFiles)) continue;
    if (const auto x = metric.value(scan)) {
      values.add(std::string(metric.key), fmt::format("{}", *x));
    }
  }
}

foxglove::LayoutNames layout_names(bool has_maps) {
  return {.map = has_maps ? topics::kMap : "",
          .scan = topics::kScan,
          .pose = topics::kPose,
          .region = fmt::format("{}.data", topics::kRegion),
          .diagnostics = topics::kDiagnostics,
          .status = kStatusName,
          .map_frame = kMapFrame,
          .follow = kScanFrame,
          .plots = {{{"Integrity risk", {"risk"}},
                     {"Fit", {"coverage", "nvtl", "fitness"}},
                     {"Times [ms]", {"scan_ms", "align_ms", "stall_ms", "search_ms"}}}}};
}

}  // namespace

RunRecorder::RunRecorder(std::string name, io::ros::McapWriter writer, io::OutputFile layout,
                         Bundle bundle)
    : name_(std::move(name)),
      writer_(std::move(writer)),
      layout_(std::move(layout)),
      bundle_(std::move(bundle)),
      origin_(origin_of(bundle_.directory()->summary().map_bounds)),
      has_maps_(bundle_.has_points()) {}

std::filesystem::path RunRecorder::layout_of(std::filesystem::path recording) {
  return recording.replace_extension(".foxglove.json");
}

Result<RunRecorder> RunRecorder::create(const std::filesystem::path& path, Bundle bundle,
                                        const std::string& config) {
  std::error_code ignored;  // creating the file says what is wrong
  if (path.has_parent_path()) std::filesystem::create_directories(path.parent_path(), ignored);
  VANTAGE_TRY(auto writer, io::ros::McapWriter::create(path));
  VANTAGE_TRY(auto layout, io::OutputFile::create(layout_of(path)));
  RunRecorder recorder(path.string(), std::move(writer), std::move(layout), std::move(bundle));
  VANTAGE_CHECK(recorder.describe(config));
  return recorder;
}

Result<void> RunRecorder::describe(const std::string& config) {
  VANTAGE_CHECK(writer_.add_metadata("vantage", {{"config", config},
                                                 {"origin_x", fmt::format("{}", origin_.x())},
                                                 {"origin_y", fmt::format("{}", origin_.y())},
                                                 {"origin_z", fmt::format("{}", origin_.z())},
                                                 {"map", has_maps_ ? topics::kMap : kNoMaps}}));
  const auto add = [&](auto& channel, const char* topic, const char* type) -> Result<void> {
    VANTAGE_TRY(const auto schema, io::ros::schema_of(type));
    VANTAGE_TRY(channel, writer_.add_channel(topic, schema));
    return {};
  };
  if (has_maps_) VANTAGE_CHECK(add(channels_.map, topics::kMap, "sensor_msgs/PointCloud2"));
  VANTAGE_CHECK(add(channels_.scan, topics::kScan, "sensor_msgs/PointCloud2"));
  VANTAGE_CHECK(add(channels_.pose, topics::kPose, "geometry_msgs/PoseStamped"));
  VANTAGE_CHECK(add(channels_.pose_with_covariance, topics::kPoseWithCovariance,
                    "geometry_msgs/PoseWithCovarianceStamped"));
  VANTAGE_CHECK(add(channels_.region, topics::kRegion, "std_msgs/String"));
  VANTAGE_CHECK(add(channels_.tf, topics::kTf, "tf2_msgs/TFMessage"));
  return add(channels_.diagnostics, topics::kDiagnostics, "diagnostic_msgs/DiagnosticArray");
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
  VANTAGE_TRY(RegionMap map, bundle_.get(region));
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
  if (report.confidence) {
    VANTAGE_TRY(const auto sure,
                io::ros::write_pose_with_covariance(header, pose, report.confidence->covariance));
    VANTAGE_CHECK(writer_.write(channels_.pose_with_covariance, report.stamp, sure));
  }
  VANTAGE_TRY(const DirectoryEntry entry, bundle_.directory()->entry(report.region));
  VANTAGE_TRY(const auto label, io::ros::write_string(entry.region.label));
  return writer_.write(channels_.region, report.stamp, label);
}

Result<void> RunRecorder::add_diagnostics(const RunScan& result) {
  const ScanReport& report = result.report;
  Values values;
  add_state(values, report);
  add_metrics(values, result);
  values.add("origin_m", text_of(origin_));
  if (!has_maps_) values.add("map", std::string(kNoMaps));
  const std::array diagnostics{Diagnostic{.level = level_of(report),
                                          .name = kStatusName,
                                          .message = message_of(report),
                                          .values = std::move(values).take()}};
  VANTAGE_TRY(const auto message,
              io::ros::write_diagnostics({.stamp = report.stamp, .frame = kMapFrame}, diagnostics));
  return writer_.write(channels_.diagnostics, report.stamp, message);
}

Result<void> RunRecorder::commit() {
  VANTAGE_CHECK(layout_.write(foxglove::layout(layout_names(has_maps_))));
  VANTAGE_CHECK(writer_.commit());
  return layout_.commit();
}

std::string RunRecorder::summary() const {
  std::string line = fmt::format("recorded in {}: {}, ", name_, cli::counted(scans_, "scan"));
  line +=
      has_maps_ ? cli::counted(maps_, "region map") : fmt::format("no region maps ({})", kNoMaps);
  if (!origin_.isZero(0.0))
    line += fmt::format("; {} m subtracted from all places", text_of(origin_));
  line += fmt::format("\nlayout for Foxglove: {}", layout_of(name_).string());
  return line;
}

}  // namespace vantage
