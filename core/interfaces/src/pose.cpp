#include "vantage/pose.hpp"

#include <cmath>

namespace vantage {

Pose Pose::operator*(const Pose& other) const noexcept {
  Pose result;
  result.rotation = (rotation * other.rotation).normalized();
  result.translation = *this * other.translation;
  return result;
}

Pose Pose::inverse() const noexcept {
  Pose result;
  result.rotation = rotation.conjugate();
  result.translation = -(result.rotation.toRotationMatrix() * translation);
  return result;
}

Pose pose_from_xyz_rpy(const Eigen::Vector3d& xyz, const Eigen::Vector3d& rpy) noexcept {
  Pose pose;
  pose.rotation = (Eigen::AngleAxisd(rpy.z(), Eigen::Vector3d::UnitZ()) *
                   Eigen::AngleAxisd(rpy.y(), Eigen::Vector3d::UnitY()) *
                   Eigen::AngleAxisd(rpy.x(), Eigen::Vector3d::UnitX()))
                      .normalized();
  pose.translation = xyz;
  return pose;
}

Eigen::Quaternion<double, Eigen::DontAlign> rotation_from_vector(
    const Eigen::Vector3d& rotation_vector) noexcept {
  const double angle = rotation_vector.norm();
  // sin(a/2)/a by its series near zero, where the quotient loses digits.
  const double factor = angle < 1e-6 ? 0.5 - angle * angle / 48.0 : std::sin(angle / 2.0) / angle;
  const Eigen::Vector3d v = factor * rotation_vector;
  return Eigen::Quaternion<double, Eigen::DontAlign>(std::cos(angle / 2.0), v.x(), v.y(), v.z())
      .normalized();
}

double rotation_between(const Pose& a, const Pose& b) noexcept {
  const Eigen::Quaternion<double, Eigen::DontAlign> difference =
      a.rotation.conjugate() * b.rotation;
  return 2.0 * std::atan2(difference.vec().norm(), std::abs(difference.w()));
}

bool is_valid(const Pose& pose) noexcept {
  return pose.translation.allFinite() && pose.rotation.coeffs().allFinite() &&
         std::abs(pose.rotation.norm() - 1.0) < 1e-6;
}

}  // namespace vantage
