#pragma once

#include <Eigen/Core>
#include <cstdint>

#include "vantage/api.hpp"
#include "vantage/scan_matcher.hpp"

namespace vantage {

/// How sure an alignment is of its pose.
struct PoseConfidence {
  /// Covariance of [translation; rotation vector], map axes, rotation about the sensor [m^2, m rad,
  /// rad^2].
  Alignment::Hessian covariance = Alignment::Hessian::Zero();
  /// Standard deviations along the principal axes, the largest first.
  Eigen::Vector3d sigma_translation = Eigen::Vector3d::Zero();  ///< [m]
  Eigen::Vector3d sigma_rotation = Eigen::Vector3d::Zero();     ///< [rad]
  /// The axis of the largest standard deviation of the translation, map frame; of unit length.
  Eigen::Vector3d weakest_direction = Eigen::Vector3d::UnitX();
  /// The number of directions, of six, about which the scan says nothing: sliding along a wall, or
  /// turning in a round hall. Their standard deviation is at the limit or above.
  std::uint32_t degenerate = 0;
};

/// Computes the confidence from an alignment's Hessian.
/// @param scale  > 0; multiplies the inverse Hessian, which takes the errors of points as
///               independent. Errors that points share make the true covariance larger
/// A direction is degenerate if its standard deviation exceeds 0.5 m or 5 degrees.
[[nodiscard]] VANTAGE_API PoseConfidence confidence_of(const Alignment& alignment, double scale);

}  // namespace vantage
