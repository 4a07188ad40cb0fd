#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <optional>

#include "vantage/pose.hpp"

namespace vantage::matching {

/// [translation; rotation vector]
using Vector6 = Eigen::Matrix<double, 6, 1>;
using Matrix6 = Eigen::Matrix<double, 6, 6>;

struct StepOptions {
  std::uint32_t max_iterations = 30;
  double translation_epsilon = 1e-3;  ///< [m]
  double rotation_epsilon = 1e-4;     ///< [rad]
  double max_step_translation = 0.5;  ///< [m]
  double max_step_rotation = 0.1;     ///< [rad]

  [[nodiscard]] bool negligible(const Vector6& step) const noexcept {
    return step.head<3>().norm() < translation_epsilon && step.tail<3>().norm() < rotation_epsilon;
  }
};

/// A normal matrix with a little more on its diagonal: directions in which the matches say nothing
/// (a plane's) give no endless steps.
[[nodiscard]] Matrix6 ridged(const Matrix6& normal);

/// A step shortened to the limits; nothing for one that is not finite.
[[nodiscard]] std::optional<Vector6> shortened(Vector6 step, const StepOptions& options);

/// The pose moved by a translation and a rotation about the sensor, its rotation renormalized.
[[nodiscard]] Pose moved(const Pose& pose, const Vector6& step);

}  // namespace vantage::matching
