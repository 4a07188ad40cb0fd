#include "gauss_newton.hpp"

#include <Eigen/Cholesky>

namespace vantage::matching {
namespace {

// Prevents endless steps in directions about which the matches say nothing (along a plane).
constexpr double kRidge = 1e-6;

}  // namespace

std::optional<Vector6> gauss_newton_step(const NormalEquations& at, const StepOptions& options) {
  Matrix6 damped = at.hessian;
  damped.diagonal().head<3>().array() += kRidge * at.hessian.diagonal().head<3>().maxCoeff();
  damped.diagonal().tail<3>().array() += kRidge * at.hessian.diagonal().tail<3>().maxCoeff();
  const Eigen::LLT<Matrix6> root(damped);
  if (root.info() != Eigen::Success) return std::nullopt;
  Vector6 step = -root.solve(at.gradient);
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
