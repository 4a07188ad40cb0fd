#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <functional>
#include <optional>
#include <string>
#include <vector>

#include "vantage/engine/config.hpp"
#include "vantage/engine/localizer.hpp"
#include "vantage/engine/plugin_loader.hpp"
#include "vantage/io/scan_source.hpp"
#include "vantage/io/trajectory_io.hpp"
#include "vantage/map_store.hpp"
#include "vantage/result.hpp"

namespace vantage {

/// The part of a recording that is used, in seconds after its first scan.
struct TimeWindow {
  double start = 0.0;
  std::optional<double> duration = {};  ///< to the end if there is none
};

struct RunScan;

/// What a run is fed with.
struct RunInputs {
  io::ScanOptions scans;  ///< opened anew for each run
  TimeWindow window = {};
  std::optional<Pose> initial_pose = {};  ///< T_map_sensor of the first scan; else the reference's
  bool start_anywhere = false;            ///< neither: the sensor is looked for
  std::optional<double> speed = {};  ///< scans come so many times faster than they were recorded;
                                     ///< each as soon as the last is done if none is given
  std::optional<io::Trajectory> reference = {};  ///< T_map_sensor
  std::optional<io::Trajectory> odometry = {};   ///< T_odom_sensor
  /// Called with every scan after it was localized, if set; its errors end the run.
  std::function<Result<void>(const io::StampedScan&, const RunScan&)> observe = {};
};

/// How far an estimate is from the reference: without any alignment of the trajectories.
struct PoseError {
  double metres = 0.0, degrees = 0.0;
  /// Estimate minus reference, map axes: translation [m], rotation vector [rad].
  Eigen::Vector3d translation = Eigen::Vector3d::Zero(), rotation = Eigen::Vector3d::Zero();
};

struct RunScan {
  ScanReport report;
  std::uint64_t dropped_by_reader = 0;  ///< non-finite points that the file held
  std::optional<Pose> reference;        ///< T_map_sensor; none where there is none
  std::optional<PoseError> error;       ///< none without a reference or without a pose
};

[[nodiscard]] inline bool is_tracked(const RunScan& scan) {
  return scan.report.tracking == Tracking::tracked;
}

/// One pass over recorded scans with one configuration.
struct Run {
  std::string config;  ///< its file
  std::string stamp_rule;
  io::SkippedScans skipped = {};  ///< scans that the recording has and that cannot be used
  MapIndex index;
  std::vector<RunScan> scans;
  std::optional<double> speed = {};  ///< of the replay, see RunInputs
  double seconds_late = 0.0;  ///< most that a scan had to wait for those before it, at that speed
};

/// The way so far at each scan [m]: along the reference; along the poses where there is none.
[[nodiscard]] std::vector<double> distances(const Run& run);

/// Told how many scans are done and how many there are; 0 where the recording does not say.
using ScanProgress = std::function<void(std::size_t, std::size_t)>;

/// Localizes every scan. Errors: a missing table, plugin or bundle, no first pose, a scan that
/// cannot be read.
[[nodiscard]] Result<Run> localize_scans(const Config& config, const PluginLoader& loader,
                                         const RunInputs& inputs,
                                         const ScanProgress& progress = {});

/// The same with a localizer that was opened elsewhere.
/// @param config  its file
[[nodiscard]] Result<Run> localize_scans(Localizer localizer, const std::string& config,
                                         const RunInputs& inputs,
                                         const ScanProgress& progress = {});

/// The tracked poses. Lost scans are left out: their pose is a mere prediction (see scans.csv).
[[nodiscard]] io::Trajectory trajectory_of(const Run& run);

}  // namespace vantage
