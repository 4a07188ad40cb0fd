#pragma once

#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include "io/ros/mcap_writer.hpp"
#include "io/ros/message_writers.hpp"
#include "vantage/engine/bundle.hpp"
#include "vantage/evaluation/run.hpp"
#include "vantage/io/scan_source.hpp"
#include "vantage/kit/atomic_file.hpp"
#include "vantage/result.hpp"

namespace vantage {

/// Records a run as messages of ROS 2 in an MCAP file, all with the stamp of their scan:
/// - /map (sensor_msgs/PointCloud2): the region map, at the start and at every switch
/// - /scan (sensor_msgs/PointCloud2): the points as they were recorded, frame "lidar"; with their
///   seconds after the stamp in "time" if they are known
/// - /pose (geometry_msgs/PoseStamped), /tf (from "map" to "lidar") and /region (std_msgs/String,
///   its label): not before the sensor has been found
/// - /diagnostics (diagnostic_msgs/DiagnosticArray): the numbers of scans.csv
///
/// Clouds contain float32. If the map reaches 10 km or more from its origin, whole metres are
/// subtracted from everything in the frame "map"; the metadata record "vantage" and the diagnostics
/// say how many.
///
/// A layout with which Foxglove shows all of this is written beside the recording.
class RunRecorder {
 public:
  /// "run.foxglove.json" for "run.mcap".
  [[nodiscard]] static std::filesystem::path layout_of(std::filesystem::path recording);

  /// @param bundle  of the run: the region maps are read from it
  /// @param config  the file of the run's configuration
  /// Errors: those of McapWriter::create and OutputFile::create, after the file's folder was
  /// created if need be.
  [[nodiscard]] static Result<RunRecorder> create(const std::filesystem::path& path, Bundle bundle,
                                                  const std::string& config);

  /// Errors: those of McapWriter::write and MapReader::get.
  [[nodiscard]] Result<void> add(const io::StampedScan& scan, const RunScan& result);
  /// Puts the files in place; call once, at the end. Errors: those of McapWriter::commit and
  /// OutputFile.
  [[nodiscard]] Result<void> commit();

  /// Says what was recorded where, and what was left out.
  [[nodiscard]] std::string summary() const;

 private:
  struct Channels {
    io::ros::McapWriter::ChannelId map = 0, scan = 0, pose = 0, pose_with_covariance = 0,
                                   region = 0, tf = 0, diagnostics = 0;
  };

  RunRecorder(std::string name, io::ros::McapWriter writer, io::OutputFile layout, Bundle bundle);
  [[nodiscard]] Result<void> describe(const std::string& config);
  [[nodiscard]] Result<void> add_map(double stamp, RegionId region);
  [[nodiscard]] Result<void> add_scan(const io::StampedScan& scan);
  [[nodiscard]] Result<void> add_pose(const ScanReport& report);
  [[nodiscard]] Result<void> add_diagnostics(const RunScan& result);

  std::string name_;
  io::ros::McapWriter writer_;
  io::OutputFile layout_;
  Bundle bundle_;
  Channels channels_;
  Point origin_ = Point::Zero();  // of the frame "map" in the map's own coordinates [m]
  bool has_maps_ = false;
  std::optional<RegionId> shown_;  // the region whose map was last written to /map
  std::size_t scans_ = 0, maps_ = 0;
};

}  // namespace vantage
