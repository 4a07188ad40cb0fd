#include "newton.hpp"

#include <Eigen/Cholesky>
#include <Eigen/Eigenvalues>
#include <optional>

namespace vantage::ndt {
namespace {

// The majorizer's own step lengthened by 1 / 0.5 is the longest that cannot ascend.
constexpr double kCurvatureFloor = 0.5;
constexpr double kSufficientDecrease = 1e-4;  // Armijo's c1

/// The Newton step, shortened where the model of the objective cannot be trusted; nothing where the
/// objective is flat.
std::optional<Vector6> newton_step(const Derivatives& at, const NewtonOptions& options) {
  // The majorizer M = L L^T measures the Hessian: the eigenvalues of L^-1 H L^-T are at most 1 (but
  // for the rotation's curvature), 0.5-0.9 at a good fit, and negative in the outliers' directions.
  const Eigen::LLT<Matrix6> root(matching::ridged(at.majorizer));
  if (root.info() != Eigen::Success) return std::nullopt;
  if (options.optimizer == Optimizer::gauss_newton) {
    return matching::shortened(-root.solve(at.gradient), options);
  }
  const Matrix6 half_way = root.matrixL().solve(at.hessian);
  const Matrix6 relative = root.matrixL().solve(half_way.transpose());
  const Eigen::SelfAdjointEigenSolver<Matrix6> solver(relative);
  const Vector6 curvature = solver.eigenvalues().cwiseMax(kCurvatureFloor);
  const Vector6 gradient = solver.eigenvectors().transpose() * root.matrixL().solve(at.gradient);
  return matching::shortened(
      -root.matrixU().solve(solver.eigenvectors() * gradient.cwiseQuotient(curvature)), options);
}

}  // namespace

Extent extent_of(const NewtonOptions& options) noexcept {
  return {.terms = options.optimizer == Optimizer::newton ? kernel::Terms::everything
                                                          : kernel::Terms::majorizer,
          .stride = options.stride};
}

Minimum minimize(const Objective& objective, const Pose& start, const Derivatives& at_start,
                 const NewtonOptions& options, Workspace& workspace) {
  const Extent extent = extent_of(options);
  Minimum best{.T_local_scan = start, .at = at_start};
  while (best.iterations < options.max_iterations) {
    ++best.iterations;
    std::optional<Vector6> step = newton_step(best.at, options);
    if (!step) {
      best.termination = Termination::no_progress;
      return best;
    }
    const bool last = options.negligible(*step);
    for (;;) {
      const Pose trial = matching::moved(best.T_local_scan, *step);
      const Derivatives at_trial = objective.derivatives(trial, workspace, extent);
      if (at_trial.value <= best.at.value + kSufficientDecrease * best.at.gradient.dot(*step)) {
        best.T_local_scan = trial;
        best.at = at_trial;
        break;
      }
      *step *= 0.5;
      if (last || options.negligible(*step)) {
        best.termination = last ? Termination::converged : Termination::no_progress;
        return best;
      }
    }
    if (options.negligible(*step)) {
      best.termination = Termination::converged;
      return best;
    }
  }
  return best;
}

}  // namespace vantage::ndt
