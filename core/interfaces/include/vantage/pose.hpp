#pragma once

#include <Eigen/Core>
#include <Eigen/Geometry>

#include "vantage/api.hpp"
#include "vantage/point_cloud.hpp"

namespace vantage {

/// A rigid transform T_target_source: `p_target = T_target_source * p_source`.
/// The rotation is a unit quaternion; products and inverse() preserve this.
struct Pose {
  Eigen::Quaternion<double, Eigen::DontAlign> rotation =
      Eigen::Quaternion<double, Eigen::DontAlign>::Identity();
  Eigen::Vector3d translation = Eigen::Vector3d::Zero();  ///< [m]

  [[nodiscard]] Point operator*(const Point& p) const noexcept {
    return rotation.toRotationMatrix() * p + translation;
  }
  /// T_a_c = T_a_b * T_b_c, renormalized.
  [[nodiscard]] VANTAGE_API Pose operator*(const Pose& other) const noexcept;
  [[nodiscard]] VANTAGE_API Pose inverse() const noexcept;
};

/// A pose from position [m] and fixed-axis roll, pitch, yaw [rad]:
/// R = Rz(yaw) Ry(pitch) Rx(roll).
[[nodiscard]] VANTAGE_API Pose pose_from_xyz_rpy(const Eigen::Vector3d& xyz,
                                                 const Eigen::Vector3d& rpy) noexcept;

/// The unit quaternion of a rotation vector (axis times angle [rad]), by the exponential map.
[[nodiscard]] VANTAGE_API Eigen::Quaternion<double, Eigen::DontAlign> rotation_from_vector(
    const Eigen::Vector3d& rotation_vector) noexcept;

/// The angle of the rotation between two poses [rad], in [0, pi].
[[nodiscard]] VANTAGE_API double rotation_between(const Pose& a, const Pose& b) noexcept;

/// Whether every number of the pose is finite and the rotation has unit length (to 1e-6).
[[nodiscard]] VANTAGE_API bool is_valid(const Pose& pose) noexcept;

}  // namespace vantage
