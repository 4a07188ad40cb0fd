#include "vantage/track/rotation.hpp"

#include <cmath>

namespace vantage {

Eigen::Vector3d rotation_vector_of(const Eigen::Quaterniond& rotation) noexcept {
  const double side = rotation.w() < 0.0 ? -1.0 : 1.0;  // the short way round
  const Eigen::Vector3d axis = side * rotation.vec();
  const double sine = axis.norm();
  if (sine < 1e-9) return 2.0 * axis;
  return 2.0 * std::atan2(sine, side * rotation.w()) / sine * axis;
}

Eigen::Matrix3d left_jacobian(const Eigen::Vector3d& theta) noexcept {
  const double angle = theta.norm();
  const Eigen::Matrix3d across = skew(theta);
  const bool small = angle < 1e-4;
  const double a = small ? 0.5 : (1.0 - std::cos(angle)) / (angle * angle);
  const double b = small ? 1.0 / 6.0 : (angle - std::sin(angle)) / (angle * angle * angle);
  return Eigen::Matrix3d::Identity() + a * across + b * across * across;
}

Pose exponential(const Twist& twist) noexcept {
  Pose pose;
  pose.rotation = rotation_from_vector(twist.angular);
  pose.translation = left_jacobian(twist.angular) * twist.linear;
  return pose;
}

Twist logarithm(const Pose& pose) noexcept {
  Twist twist;
  twist.angular = rotation_vector_of(Eigen::Quaterniond(pose.rotation));
  twist.linear = left_jacobian(twist.angular).inverse() * pose.translation;
  return twist;
}

Pose interpolate(const Pose& a, const Pose& b, double fraction) noexcept {
  const Pose step = a.inverse() * b;
  const Eigen::AngleAxisd rotation{Eigen::Quaterniond(step.rotation)};
  Pose result;
  result.rotation =
      (a.rotation * rotation_from_vector(rotation.axis() * (rotation.angle() * fraction)))
          .normalized();
  result.translation = a.translation + fraction * (b.translation - a.translation);
  return result;
}

}  // namespace vantage
