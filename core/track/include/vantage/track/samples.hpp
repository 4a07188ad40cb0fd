#pragma once

#include <Eigen/Core>

#include "vantage/pose.hpp"

namespace vantage {

/// What an inertial measurement unit measured at one moment.
struct ImuSample {
  double stamp = 0.0;                                          ///< [s], the clock of the scans
  Eigen::Vector3d angular_velocity = Eigen::Vector3d::Zero();  ///< IMU frame [rad/s]
  /// Acceleration less gravity, IMU frame [m/s^2]: at rest, 9.81 along the axis that points up.
  Eigen::Vector3d specific_force = Eigen::Vector3d::Zero();
};

/// Where a robot's odometry says that it is.
struct OdometrySample {
  double stamp = 0.0;  ///< [s], the clock of the scans
  Pose T_odom_body;    ///< of the frame whose motion is measured; the odometry frame drifts
};

/// No robot turns faster [rad/s] or is pushed harder [m/s^2], and no map is larger [m]. What is
/// beyond is a damaged number, and would make every pose one.
inline constexpr double kFastestTurn = 1e3, kLargestForce = 1e5, kEarthSize = 1e8;
[[nodiscard]] inline bool is_on_earth(const Pose& pose) noexcept {
  return pose.translation.norm() < kEarthSize;
}

/// Whether every number of a sample is finite and possible, and its pose is a rigid transform.
[[nodiscard]] bool is_valid(const ImuSample& sample) noexcept;
[[nodiscard]] bool is_valid(const OdometrySample& sample) noexcept;

}  // namespace vantage
