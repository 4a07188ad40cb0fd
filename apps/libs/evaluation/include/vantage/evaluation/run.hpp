#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <functional>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "vantage/engine/config.hpp"
#include "vantage/engine/localizer.hpp"
#include "vantage/engine/plugin_loader.hpp"
#include "vantage/engine/predicted_errors.hpp"
#include "vantage/io/imu_io.hpp"
#include "vantage/io/opened_scans.hpp"
#include "vantage/io/pose_priors.hpp"
#include "vantage/io/scan_source.hpp"
#include "vantage/io/trajectory_io.hpp"
#include "vantage/map_store.hpp"
#include "vantage/result.hpp"

namespace vantage {

/// The part of a recording that is used.
struct TimeWindow {
  double start = 0.0;                   ///< after the first scan of the recording [s]
  std::optional<double> duration = {};  ///< after the first scan used [s]; empty: to the end
};

/// The inputs of a run.
struct RunInputs {
  io::ScanOptions scans;                       ///< opened by the run if `opened` is empty
  std::optional<io::OpenedScans> opened = {};  ///< the same scans, already open
  TimeWindow window = {};
  std::optional<Pose> initial_pose = {};  ///< T_map_sensor of the first scan; if empty, it is
                                          ///< searched with the priors, or the reference gives it
  bool start_anywhere = false;       ///< without an initial pose: search, do not use the reference
  std::optional<double> speed = {};  ///< scans come this many times faster than recorded; if empty,
                                     ///< each scan comes as soon as the last is done
  std::optional<io::Trajectory> reference = {};  ///< T_map_sensor
  std::optional<io::Trajectory> odometry = {};   ///< T_odom_sensor
  /// Scan::prior of the scans. Without an initial pose, the run starts with a search, which uses
  /// them; the reference then only measures errors.
  std::optional<io::PosePriors> priors = {};
  /// What the sensor's inertial measurement unit says.
  std::optional<io::ImuRecording> imu = {};
  /// At which bags end that are cut off or damaged, and of which something other than scans was
  /// read; what comes before is used. Each is there once.
  std::vector<Error> damaged = {};
};

/// The samples of the IMU; none without one.
[[nodiscard]] inline std::span<const ImuSample> samples_of(const RunInputs& inputs) {
  return inputs.imu ? std::span<const ImuSample>(inputs.imu->samples)
                    : std::span<const ImuSample>();
}

/// Adds an error to RunInputs::damaged, if there is one and no other input has met it.
void add_damage(RunInputs& inputs, const std::optional<Error>& damage);
/// RunInputs::damaged without what ends the scans, too: a run says it as its failure.
[[nodiscard]] std::vector<Error> damaged_besides_scans(const RunInputs& inputs);

/// The difference between an estimate and the reference. The trajectories are not aligned first.
struct PoseError {
  double metres = 0.0, degrees = 0.0;
  /// Estimate minus reference, map axes: translation [m], rotation vector [rad].
  Eigen::Vector3d translation = Eigen::Vector3d::Zero(), rotation = Eigen::Vector3d::Zero();
};

/// The alert limit of a run: a tracked pose beyond it is misleading information. See
/// LocalizerParams.
struct AlertLimit {
  double metres = LocalizerParams{}.alert_limit, degrees = LocalizerParams{}.alert_limit_deg;
};

/// One localized scan of a run.
struct RunScan {
  ScanReport report;
  double seconds = 0.0;                 ///< from the points to the report
  std::uint64_t dropped_by_reader = 0;  ///< points in the file that are no measurements
  std::optional<Pose> reference;        ///< T_map_sensor; none if the reference has no pose here
  std::optional<PoseError> error;       ///< none without a reference or without a pose
  std::optional<PoseError> prediction_error = {};  ///< of the pose before matching
  /// Of the map in use, where the sensor is: see predict. None if no selector chose its elements.
  std::optional<PredictedError> predicted = {};
  std::string region = {};             ///< label of the region in use
  RegionSummary map = {};              ///< of that region, from the bundle's index
  std::uint64_t wide_area_points = 0;  ///< points of the map from which the bundle was built
  AlertLimit alert_limit = {};         ///< of the run
};

[[nodiscard]] inline bool is_tracked(const RunScan& scan) {
  return scan.report.tracking == Tracking::tracked;
}

/// Adds to a scan with a pose what its bundle predicts where the sensor is, by the reference if
/// there is one.
void predict(RunScan& scan, const PredictedErrors& of_bundle);

/// The priors of a run.
struct PriorUse {
  std::string source;              ///< the path and the topic
  std::size_t scans = 0;           ///< that had one
  std::vector<std::string> notes;  ///< see io::PosePriors
};

/// What is known of a run besides its scans.
struct RunInfo {
  std::string config;             ///< the path of the configuration file
  std::string stamp_rule;         ///< where the stamps come from
  io::SkippedScans skipped = {};  ///< scans of the recording that cannot be used
  std::uint64_t map_points = 0;   ///< of the map from which the bundle was built
  std::uint64_t regions = 0;      ///< of the bundle
  AlertLimit alert_limit = {};
  std::optional<PriorUse> prior = {};  ///< empty without priors
  std::optional<double> speed = {};    ///< of the replay, see RunInputs
  double seconds_late = 0.0;           ///< longest delay of a scan behind its replay time
  std::size_t timed = 0;               ///< scans whose points have times
  std::optional<Error> failure = {};   ///< why the run ended early; the scans before it are there
};

/// Checks that each other input has something of the time of the scans. It is done before a run, as
/// far as the recording says when its last scan is, and again at its end.
/// @param first_stamp  of the first scan of the window [s]
/// @param scans        the recording
/// Errors: `invalid_input`, with the times of both, and the unit in which they would agree.
[[nodiscard]] Result<void> check_stamps(const RunInputs& inputs, double first_stamp,
                                        const io::ScanDescription& scans);

/// The beginning of a recording.
struct ScansRead {
  std::vector<io::StampedScan> scans;
  std::vector<io::StampedScan> later = {};  ///< spread over the rest of it
  std::optional<Error> damage = {};         ///< at which the recording ends after at least one scan
};
/// The first scans of the run's window. Errors: those of the recording.
/// @param later  the number of later ones; fewer if the recording does not say how long it is
[[nodiscard]] Result<ScansRead> first_scans(const RunInputs& inputs, std::size_t count,
                                            std::size_t later = 0);

/// One pass over recorded scans with one configuration.
struct Run : RunInfo {
  std::vector<RunScan> scans;
};

/// Measures the distance travelled: along the reference from the first scan that it has a pose for,
/// and along the poses until then.
class Odometer {
 public:
  /// The distance up to the next scan [m].
  double operator()(const RunScan& scan);

 private:
  bool referenced_ = false;
  std::optional<Eigen::Vector3d> last_;
  double sum_ = 0.0;
};

/// The distance travelled up to each scan [m], see Odometer.
[[nodiscard]] std::vector<double> distances(const Run& run);

/// Called with the number of scans done and the number of all scans. The latter is 0 if it is
/// unknown: the recording does not say, or the window is only a part of it.
using ScanProgress = std::function<void(std::size_t, std::size_t)>;

/// Takes a scan after it was localized. An error that it returns ends the run.
using ScanSink = std::function<Result<void>(const io::StampedScan&, RunScan&&)>;

/// Localizes every scan and hands it on; keeps none, so that its memory does not grow. A scan that
/// cannot be read or localized ends the run: RunInfo::failure says why.
/// @param config  the path of the configuration file
/// Errors: no initial pose; priors or an IMU that measured during no scan; the first scan's
/// failure; those of the sink.
[[nodiscard]] Result<RunInfo> localize_each(Localizer localizer, const std::string& config,
                                            const RunInputs& inputs, const ScanSink& sink,
                                            const ScanProgress& progress = {});

/// Localizes every scan and keeps the results. Errors: those above; a missing table, plugin or
/// bundle.
[[nodiscard]] Result<Run> localize_scans(const Config& config, const PluginLoader& loader,
                                         const RunInputs& inputs,
                                         const ScanProgress& progress = {});

/// Does the same with a localizer that was opened elsewhere.
[[nodiscard]] Result<Run> localize_scans(Localizer localizer, const std::string& config,
                                         const RunInputs& inputs,
                                         const ScanProgress& progress = {});

}  // namespace vantage
