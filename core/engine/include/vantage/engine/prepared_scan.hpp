#pragma once

#include <cstddef>
#include <optional>
#include <span>

#include "vantage/api.hpp"
#include "vantage/engine/localizer_params.hpp"
#include "vantage/point_cloud.hpp"
#include "vantage/pose.hpp"
#include "vantage/pose_prior.hpp"
#include "vantage/result.hpp"

namespace vantage {

/// One LiDAR sweep, the localizer's input.
struct Scan {
  double stamp = 0.0;              ///< [s]
  PointsView points;               ///< sensor frame [m]; non-finite points are dropped and counted
  std::optional<Pose> odometry{};  ///< T_odom_sensor at the stamp; better than constant velocity
  std::span<const float> seconds{};  ///< time of each point after `stamp` [s]; empty if unknown
  std::optional<PosePrior> prior{};  ///< where the sensor is at the stamp, by another sensor
};

/// A scan made ready for matching: non-finite points dropped, range limits applied, thinned to
/// voxel centroids.
struct PreparedScan {
  PointCloud points;
  PointCloud finite;        ///< before it was thinned
  std::size_t dropped = 0;  ///< non-finite
};
[[nodiscard]] VANTAGE_API Result<PreparedScan> prepare_scan(PointsView points,
                                                            const LocalizerParams& params);

}  // namespace vantage
