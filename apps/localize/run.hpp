#pragma once

#include <CLI/CLI.hpp>
#include <array>
#include <filesystem>
#include <functional>
#include <nlohmann/json_fwd.hpp>
#include <optional>
#include <string>
#include <vector>

#include "terminal/statistics.hpp"
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

/// How far the estimated motion between two scans is from the true one: the translation and the
/// turn of (true motion)^-1 * (estimated motion).
struct RelativeErrors {
  cli::Statistics m, deg;
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

/// The numbers of a run that people compare. Errors and scores are over tracked scans.
struct RunSummary {
  std::size_t scans = 0, tracked = 0, lost = 0, recovered = 0, switches = 0, outside = 0;
  std::size_t blocking_loads = 0;  ///< switches to a map that was not ready
  /// Scans more than 2 m or 5 degrees from the reference, and those of them that count as tracked.
  std::size_t far_off = 0, tracked_far_off = 0;
  std::uint64_t dropped_points = 0;
  cli::Statistics error_m, error_deg;
  RelativeErrors relative_frame;  ///< from each scan to the next; both tracked
  RelativeErrors relative_10m;    ///< to the first scan 10 m on along the reference; both tracked
  cli::Statistics align_ms, search_ms;  ///< search over the scans that looked for the sensor
  cli::Statistics stall_ms;             ///< that scans waited for their map
  cli::Statistics load_ms, prepare_ms;  ///< over switches, by whatever thread
  cli::Statistics sigma_m;              ///< largest standard deviation that is claimed
  /// Share of the errors along map axes within 1, 2 and 3 of the standard deviations claimed.
  std::array<double, 3> within_sigmas_translation{}, within_sigmas_rotation{};
  std::size_t held_bytes = 0;  ///< most memory that ready maps took at once
  cli::Statistics map_points, iterations, fitness, nvtl, coverage, lcp;
};

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

[[nodiscard]] RunSummary summarize(const Run& run);
[[nodiscard]] nlohmann::ordered_json to_json(const Run& run, const RunSummary& summary);

/// The tracked poses. Lost scans are left out: their pose is a mere prediction (see scans.csv).
[[nodiscard]] io::Trajectory trajectory_of(const Run& run);

/// One line a scan, with a header; times in ms, lengths in m, angles in degrees; `distance_m` is
/// the way so far along the reference, or along the estimates where there is none.
[[nodiscard]] std::string to_csv(const Run& run);

/// Writes trajectory.tum, scans.csv and summary.json into a folder, which is created if need be.
[[nodiscard]] Result<void> write_run(const Run& run, const RunSummary& summary,
                                     const std::filesystem::path& folder);

/// What the options of the same name say, in all programs that have them.
inline constexpr const char* kPoseTopicHelp =
    "its topic, where a bag has several; of transforms with frames: /tf:map:base_link";
inline constexpr const char* kMountHelp =
    "pose of the sensor in the frame whose poses a bag has, x,y,z,roll,pitch,yaw [m, rad], where "
    "no /tf_static says it";

/// The options that say what a run is fed with.
struct InputOptions {
  std::filesystem::path scans = {}, reference = {}, odometry = {};  ///< an empty path is none
  std::string topic = {};                                 ///< of the scans, in a bag with several
  std::string reference_topic = {}, odometry_topic = {};  ///< of bags, see io::TrajectorySource
  std::string mount = {};  ///< --mount: x,y,z,roll,pitch,yaw, or empty
  TimeWindow window = {};
  double rate_hz = 10.0;

  void add_to(CLI::App& app, bool reference_required);
  [[nodiscard]] Result<RunInputs> open() const;
};

}  // namespace vantage
