#pragma once

#include <Eigen/Core>
#include <cstdint>

#include "vantage/api.hpp"
#include "vantage/scan_matcher.hpp"

namespace vantage {

/// How sure an alignment is of its pose.
struct PoseConfidence {
  /// Of [translation; rotation vector], map axes, rotation about the sensor [m^2, m rad, rad^2].
  Alignment::Hessian covariance = Alignment::Hessian::Zero();
  /// Standard deviations along their own axes, the largest first.
  Eigen::Vector3d sigma_translation = Eigen::Vector3d::Zero();  ///< [m]
  Eigen::Vector3d sigma_rotation = Eigen::Vector3d::Zero();     ///< [rad]
  /// The axis of the largest translation, map frame; of unit length.
  Eigen::Vector3d weakest_direction = Eigen::Vector3d::UnitX();
  /// How many of the six directions the scan says nothing of: sliding along a wall, turning in a
  /// round hall. Their sigma is that of the limit or more.
  std::uint32_t degenerate = 0;
};

/// From an alignment's Hessian.
/// @param scale  by how much errors that points share make the covariance larger than the inverse
///               Hessian, which takes them for independent; > 0
/// A direction is degenerate if its standard deviation exceeds 0.5 m or 5 degrees.
[[nodiscard]] VANTAGE_API PoseConfidence confidence_of(const Alignment& alignment, double scale);

}  // namespace vantage
