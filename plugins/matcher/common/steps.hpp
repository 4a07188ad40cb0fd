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

/// A normal matrix with slightly larger diagonal elements, so that directions without information
/// (along a single plane) do not give unbounded steps.
[[nodiscard]] Matrix6 ridged(const Matrix6& normal);

/// A step shortened to the limits; none if the step is not finite.
[[nodiscard]] std::optional<Vector6> shortened(Vector6 step, const StepOptions& options);

/// The pose moved by a translation and rotated about the sensor; its rotation is renormalized.
[[nodiscard]] Pose moved(const Pose& pose, const Vector6& step);

}  // namespace vantage::matching
