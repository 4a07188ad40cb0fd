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
#include "vantage/io/opened_scans.hpp"
#include "vantage/io/scan_source.hpp"
#include "vantage/io/trajectory_io.hpp"
#include "vantage/map_store.hpp"
#include "vantage/result.hpp"

namespace vantage {

/// The part of a recording that is used, in seconds after its first scan.
struct TimeWindow {
  double start = 0.0;
  std::optional<double> duration = {};  ///< without it, the window ends with the recording
};

struct RunScan;

/// The inputs of a run.
struct RunInputs {
  io::ScanOptions scans;  ///< opened anew for each run, but for the first if they are open:
  std::optional<io::OpenedScans> opened = {};  ///< `scans`, opened to look at them
  TimeWindow window = {};
  std::optional<Pose> initial_pose = {};  ///< T_map_sensor of the first scan; else from the
                                          ///< reference
  bool start_anywhere = false;            ///< use neither pose: search for the sensor
  std::optional<double> speed = {};  ///< how many times faster than recorded the scans come; if
                                     ///< empty, each scan comes as soon as the last is done
  std::optional<io::Trajectory> reference = {};  ///< T_map_sensor
  std::optional<io::Trajectory> odometry = {};   ///< T_odom_sensor
  /// Called with every scan after it was localized, if set. An error that it returns ends the run.
  std::function<Result<void>(const io::StampedScan&, const RunScan&)> observe = {};
};

/// How far an estimate is from the reference; the trajectories are not aligned first.
struct PoseError {
  double metres = 0.0, degrees = 0.0;
  /// Estimate minus reference, map axes: translation [m], rotation vector [rad].
  Eigen::Vector3d translation = Eigen::Vector3d::Zero(), rotation = Eigen::Vector3d::Zero();
};

struct RunScan {
  ScanReport report;
  std::uint64_t dropped_by_reader = 0;  ///< non-finite points in the file
  std::optional<Pose> reference;        ///< T_map_sensor; none without a reference at the stamp
  std::optional<PoseError> error;       ///< none without a reference or without a pose
  RegionSummary map = {};               ///< of the region in use, as the bundle's index has it
  std::uint64_t wide_area_points = 0;   ///< of the map that the bundle was made of
};

[[nodiscard]] inline bool is_tracked(const RunScan& scan) {
  return scan.report.tracking == Tracking::tracked;
}

/// One pass over recorded scans with one configuration.
struct Run {
  std::string config;  ///< the path of its file
  std::string stamp_rule;
  io::SkippedScans skipped = {};  ///< scans of the recording that cannot be used
  MapIndex index;
  std::vector<RunScan> scans;
  std::optional<double> speed = {};  ///< of the replay, see RunInputs
  double seconds_late = 0.0;         ///< longest wait of a scan for earlier scans, at that speed
};

/// The distance travelled up to each scan [m]: along the reference, or along the poses if there is
/// no reference.
[[nodiscard]] std::vector<double> distances(const Run& run);

/// Called with the number of scans done and the number of all; the latter is 0 if the recording
/// does not say.
using ScanProgress = std::function<void(std::size_t, std::size_t)>;

/// Localizes every scan. Errors: a missing table, plugin or bundle; no first pose; a scan that
/// cannot be read.
[[nodiscard]] Result<Run> localize_scans(const Config& config, const PluginLoader& loader,
                                         const RunInputs& inputs,
                                         const ScanProgress& progress = {});

/// Does the same with a localizer that was opened elsewhere.
/// @param config  the path of the configuration file
[[nodiscard]] Result<Run> localize_scans(Localizer localizer, const std::string& config,
                                         const RunInputs& inputs,
                                         const ScanProgress& progress = {});

/// The tracked poses. Lost scans are left out, because their poses are only predictions (see
/// scans.csv).
[[nodiscard]] io::Trajectory trajectory_of(const Run& run);

}  // namespace vantage
