#pragma once

#include <Eigen/Core>

#include "vantage/point_cloud.hpp"

namespace vantage::checks {

/// From where a scan was taken, by the rule that a sensor sees nothing behind what it sees.
struct SensorPlace {
  Eigen::Vector2d at = Eigen::Vector2d::Zero();  ///< in the frame of the points, near z = 0 [m]
  double hidden = 0.0;            ///< share of the points that lie behind others, seen from there
  double hidden_at_origin = 0.0;  ///< the same, seen from the origin

  /// Whether the scan was clearly not taken from the origin of its frame.
  [[nodiscard]] bool is_elsewhere() const;
};

/// Looks for the place from which the fewest points are hidden, unless few are from the origin.
/// @param scan  N points of one scan [m], z up
[[nodiscard]] SensorPlace find_sensor(PointsView scan);

}  // namespace vantage::checks
