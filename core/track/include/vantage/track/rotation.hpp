#pragma once

#include <Eigen/Core>
#include <Eigen/Geometry>

#include "vantage/pose.hpp"

namespace vantage {

/// The matrix of a cross product: `skew(a) * b == a.cross(b)`.
[[nodiscard]] inline Eigen::Matrix3d skew(const Eigen::Vector3d& a) noexcept {
  Eigen::Matrix3d m;
  m << 0.0, -a.z(), a.y(), a.z(), 0.0, -a.x(), -a.y(), a.x(), 0.0;
  return m;
}

/// The rotation vector of a rotation (the logarithm; its angle is at most pi) [rad].
[[nodiscard]] Eigen::Vector3d rotation_vector_of(const Eigen::Quaterniond& rotation) noexcept;

/// The left Jacobian of SO(3): Exp(theta + d) = Exp(J d) Exp(theta) to first order. A body that
/// turns by theta at a steady rate while it moves by v in its own frame arrives at J v.
[[nodiscard]] Eigen::Matrix3d left_jacobian(const Eigen::Vector3d& theta) noexcept;

/// A motion in the moving frame: translation [m] and rotation vector [rad], or both for each
/// second.
struct Twist {
  Eigen::Vector3d linear = Eigen::Vector3d::Zero();
  Eigen::Vector3d angular = Eigen::Vector3d::Zero();
};

/// Where a body arrives that follows a twist (the exponential of SE(3)), and the twist of a pose.
[[nodiscard]] Pose exponential(const Twist& twist) noexcept;
[[nodiscard]] Twist logarithm(const Pose& pose) noexcept;

/// Interpolates translation linearly and rotation spherically. A `fraction` of 0 gives `a`, 1 gives
/// `b`; values outside [0, 1] extrapolate.
[[nodiscard]] Pose interpolate(const Pose& a, const Pose& b, double fraction) noexcept;

}  // namespace vantage
