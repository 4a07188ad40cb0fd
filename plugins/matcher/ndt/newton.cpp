#include "newton.hpp"

#include <Eigen/Cholesky>
#include <Eigen/Eigenvalues>
#include <algorithm>
#include <cmath>
#include <optional>

namespace vantage::ndt {
namespace {

// Prevents endless steps in directions about which the matches say nothing (along a plane).
constexpr double kRidge = 1e-6;
// A step of 1 / 0.5 times the majorizer's own step is the longest that cannot ascend.
constexpr double kCurvatureFloor = 0.5;
constexpr double kSufficientDecrease = 1e-4;  // Armijo's c1

Pose moved(const Pose& pose, const Vector6& step) {
  Pose result;
  result.rotation = (rotation_from_vector(step.tail<3>()) * pose.rotation).normalized();
  result.translation = pose.translation + step.head<3>();
  return result;
}

std::optional<Vector6> shortened(Vector6 step, const NewtonOptions& options) {
  if (!step.allFinite()) return std::nullopt;
  const double excess = std::max(step.head<3>().norm() / options.max_step_translation,
                                 step.tail<3>().norm() / options.max_step_rotation);
  if (excess > 1.0) step /= excess;
  return step;
}

/// The Newton step, shortened where the model of the objective cannot be trusted; no step if the
/// objective is flat.
std::optional<Vector6> newton_step(const Derivatives& at, const NewtonOptions& options) {
  // The majorizer M = L L^T is the metric for the Hessian. The eigenvalues of L^-1 H L^-T are at
  // most 1 (apart from the rotation's curvature), 0.5-0.9 at a good fit, and negative in the
  // outliers' directions.
  Matrix6 metric = at.majorizer;
  metric.diagonal().head<3>().array() += kRidge * at.majorizer.diagonal().head<3>().maxCoeff();
  metric.diagonal().tail<3>().array() += kRidge * at.majorizer.diagonal().tail<3>().maxCoeff();
  const Eigen::LLT<Matrix6> root(metric);
  if (root.info() != Eigen::Success) return std::nullopt;
  if (options.optimizer == Optimizer::gauss_newton) {
    return shortened(-root.solve(at.gradient), options);
  }
  const Matrix6 half_way = root.matrixL().solve(at.hessian);
  const Matrix6 relative = root.matrixL().solve(half_way.transpose());
  const Eigen::SelfAdjointEigenSolver<Matrix6> solver(relative);
  const Vector6 curvature = solver.eigenvalues().cwiseMax(kCurvatureFloor);
  const Vector6 gradient = solver.eigenvectors().transpose() * root.matrixL().solve(at.gradient);
  return shortened(-root.matrixU().solve(solver.eigenvectors() * gradient.cwiseQuotient(curvature)),
                   options);
}

}  // namespace

Extent extent_of(const NewtonOptions& options) noexcept {
  return {.terms = options.optimizer == Optimizer::newton ? kernel::Terms::everything
                                                          : kernel::Terms::majorizer,
          .stride = options.stride};
}

Minimum minimize(const Objective& objective, const Pose& start, const Derivatives& at_start,
                 const NewtonOptions& options, Workspace& workspace) {
  const auto negligible = [&](const Vector6& step) {
    return step.head<3>().norm() < options.translation_epsilon &&
           step.tail<3>().norm() < options.rotation_epsilon;
  };

  const Extent extent = extent_of(options);
  Minimum best{.T_local_scan = start, .at = at_start};
  while (best.iterations < options.max_iterations) {
    ++best.iterations;
    std::optional<Vector6> step = newton_step(best.at, options);
    if (!step) {
      best.termination = Termination::no_progress;
      return best;
    }
    const bool last = negligible(*step);
    for (;;) {
      const Pose trial = moved(best.T_local_scan, *step);
      const Derivatives at_trial = objective.derivatives(trial, workspace, extent);
      if (at_trial.value <= best.at.value + kSufficientDecrease * best.at.gradient.dot(*step)) {
        best.T_local_scan = trial;
        best.at = at_trial;
        break;
      }
      *step *= 0.5;
      if (last || negligible(*step)) {
        best.termination = last ? Termination::converged : Termination::no_progress;
        return best;
      }
    }
    if (negligible(*step)) {
      best.termination = Termination::converged;
      return best;
    }
  }
  return best;
}

}  // namespace vantage::ndt
