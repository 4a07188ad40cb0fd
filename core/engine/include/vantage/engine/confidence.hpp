#pragma once

#include <Eigen/Core>
#include <cstddef>
#include <cstdint>

#include "vantage/api.hpp"
#include "vantage/scan_matcher.hpp"

namespace vantage {

/// How sure a pose is.
struct PoseConfidence {
  /// Covariance of [translation; rotation vector], map axes, rotation about the sensor [m^2, m rad,
  /// rad^2].
  Alignment::Hessian covariance = Alignment::Hessian::Zero();
  /// Standard deviations along the principal axes, the largest first.
  Eigen::Vector3d sigma_translation = Eigen::Vector3d::Zero();  ///< [m]
  Eigen::Vector3d sigma_rotation = Eigen::Vector3d::Zero();     ///< [rad]
  /// The axis of the largest standard deviation of the translation, map frame; of unit length.
  Eigen::Vector3d weakest_direction = Eigen::Vector3d::UnitX();
  /// The number of directions, of six, that are hardly known: sliding along a wall, or turning in a
  /// round hall. Their standard deviation exceeds 0.5 m or 5 degrees.
  std::uint32_t degenerate = 0;
};
[[nodiscard]] VANTAGE_API PoseConfidence confidence_of(const Alignment::Hessian& covariance);

/// The covariance of an alignment's pose: scale (N + 700) times the inverse Hessian, for N points.
/// The Hessian takes the errors of points for independent. Most of them are errors of the map and
/// of the place, so more points in the same places do not make a pose surer; the independent part
/// counts as if it came from 700 more points.
/// @param points  number of points that were aligned
/// @param scale   > 0; multiplies the covariance of a single point (LocalizerParams)
/// A direction about which the scan says nothing has a variance of 50 m, 500 degrees squared.
[[nodiscard]] VANTAGE_API Alignment::Hessian covariance_of(const Alignment& alignment,
                                                           std::size_t points, double scale);

}  // namespace vantage
