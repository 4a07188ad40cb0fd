#include "steps.hpp"

#include <algorithm>

namespace vantage::matching {

Matrix6 ridged(const Matrix6& normal) {
  constexpr double kRidge = 1e-6;
  Matrix6 matrix = normal;
  matrix.diagonal().head<3>().array() += kRidge * normal.diagonal().head<3>().maxCoeff();
  matrix.diagonal().tail<3>().array() += kRidge * normal.diagonal().tail<3>().maxCoeff();
  return matrix;
}

std::optional<Vector6> shortened(Vector6 step, const StepOptions& options) {
  if (!step.allFinite()) return std::nullopt;
  const double excess = std::max(step.head<3>().norm() / options.max_step_translation,
                                 step.tail<3>().norm() / options.max_step_rotation);
  if (excess > 1.0) step /= excess;
  return step;
}

Pose moved(const Pose& pose, const Vector6& step) {
  Pose result;
  result.rotation = (rotation_from_vector(step.tail<3>()) * pose.rotation).normalized();
  result.translation = pose.translation + step.head<3>();
  return result;
}

}  // namespace vantage::matching
