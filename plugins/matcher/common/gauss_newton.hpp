#pragma once

#include <Eigen/Core>
#include <cstddef>
#include <cstdint>
#include <optional>

#include "common/steps.hpp"
#include "vantage/pose.hpp"
#include "vantage/scan_matcher.hpp"

namespace vantage::matching {

/// E = 1/2 sum_i rho(d_i^T A_i d_i) at one pose, with its gradient and Gauss-Newton Hessian in
/// [translation; rotation vector] for x = t + dt + exp([w]x) y, y = R p: J_i = [I, -[y_i]x].
struct NormalEquations {
  double value = 0.0;
  Vector6 gradient = Vector6::Zero();
  /// Sum of w_i J_i^T A_i J_i. `add` sums only the blocks on and above the diagonal; `symmetrize`
  /// fills in the rest.
  Matrix6 hessian = Matrix6::Zero();
  std::size_t matched = 0;

  /// Adds one match. @param d  x - q  @param Ad  A d  @param w  rho'
  void add(const Eigen::Matrix3d& A, const Eigen::Vector3d& Ad, const Eigen::Vector3d& y, double w,
           double rho) noexcept {
    const Eigen::Vector3d g = w * Ad;
    Eigen::Matrix3d cross;  // -[y]x
    cross << 0.0, y.z(), -y.y(), -y.z(), 0.0, y.x(), y.y(), -y.x(), 0.0;
    const Eigen::Matrix3d weighted = w * A;
    const Eigen::Matrix3d mixed = weighted * cross;
    value += 0.5 * rho;
    gradient.head<3>() += g;
    gradient.tail<3>() += y.cross(g);
    hessian.topLeftCorner<3, 3>() += weighted;
    hessian.topRightCorner<3, 3>() += mixed;
    hessian.bottomRightCorner<3, 3>().noalias() += cross.transpose() * mixed;
    ++matched;
  }
  void add(const NormalEquations& other) noexcept {
    value += other.value;
    gradient += other.gradient;
    hessian += other.hessian;
    matched += other.matched;
  }
  void symmetrize() noexcept {
    hessian.triangularView<Eigen::StrictlyLower>() = hessian.transpose();
  }
};

struct Minimum {
  Pose T_local_scan;
  NormalEquations at;  ///< at that pose
  Termination termination = Termination::max_iterations;
  std::uint32_t iterations = 0;
};

/// The Gauss-Newton step, shortened to the limits; no step if the equations say nothing. Directions
/// that the matches leave open get almost no step.
[[nodiscard]] std::optional<Vector6> gauss_newton_step(const NormalEquations& at,
                                                       const StepOptions& options);

/// Gauss-Newton steps until one is negligible, matches looked for anew at each pose.
/// @param at_start  the equations at `start`
/// @param linearize  gives them for a pose and the number of steps that led there
/// @param settled  the number of steps from which on `linearize` does not depend on it any more
template <class Linearize>
[[nodiscard]] Minimum minimize(const Pose& start, const NormalEquations& at_start,
                               const StepOptions& options, std::uint32_t settled,
                               const Linearize& linearize) {
  Minimum minimum{.T_local_scan = start, .at = at_start};
  while (minimum.iterations < options.max_iterations) {
    const std::optional<Vector6> step = gauss_newton_step(minimum.at, options);
    ++minimum.iterations;
    if (!step) {
      minimum.termination = Termination::no_progress;
      return minimum;
    }
    minimum.T_local_scan = moved(minimum.T_local_scan, *step);
    minimum.at = linearize(minimum.T_local_scan, minimum.iterations);
    if (minimum.iterations > settled && options.negligible(*step)) {
      minimum.termination = Termination::converged;
      return minimum;
    }
  }
  return minimum;
}

}  // namespace vantage::matching
