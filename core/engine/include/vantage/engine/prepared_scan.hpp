#pragma once

#include <cstddef>
#include <optional>
#include <span>
#include <vector>

#include "vantage/api.hpp"
#include "vantage/engine/localizer_params.hpp"
#include "vantage/point_cloud.hpp"
#include "vantage/pose.hpp"
#include "vantage/result.hpp"
#include "vantage/track/pose_prior.hpp"
#include "vantage/track/sweep_motion.hpp"

namespace vantage {

/// One LiDAR sweep, the localizer's input.
struct Scan {
  double stamp = 0.0;  ///< [s]
  /// Each in the sensor frame at the time of its measurement [m]. Points that are not finite or
  /// farther than 10 km are dropped and counted.
  PointsView points;
  std::span<const float> seconds{};  ///< time of each point after `stamp` [s]; empty if unknown
  std::optional<PosePrior> prior{};  ///< where the sensor is at the stamp, by another sensor
};

/// The time that a scan takes; that of its stamp if its points have no times.
/// Points that prepare_scan drops do not count.
/// Errors: `invalid_input` for times of another number than points, for a sweep of more than 10 s,
/// and for one that is farther than that from the stamp.
[[nodiscard]] VANTAGE_API Result<SweepTime> time_of(const Scan& scan);

/// A scan made ready for matching: unusable points dropped, the sensor's own motion removed, range
/// limits applied, thinned to voxel centroids.
struct PreparedScan {
  PointCloud points;                 ///< sensor frame at the middle of the sweep [m]
  std::vector<double> times;         ///< of `points` [s]; empty if unknown
  PointCloud finite;                 ///< before it was thinned
  std::vector<double> finite_times;  ///< of `finite` [s]; empty if unknown
  std::size_t dropped = 0;           ///< not finite, farther than 10 km, or without a time
};
/// @param motion  of the sensor; nullptr leaves the points where they were measured
/// Errors: those of time_of and of voxel_centroids.
[[nodiscard]] VANTAGE_API Result<PreparedScan> prepare_scan(const Scan& scan,
                                                            const SweepMotion* motion,
                                                            const LocalizerParams& params);

}  // namespace vantage
