#pragma once

#include <Eigen/Core>
#include <cstddef>
#include <cstdint>
#include <optional>

#include "common/steps.hpp"
#include "vantage/pose.hpp"
#include "vantage/scan_matcher.hpp"

namespace vantage::matching {

/// E = 1/2 sum_i rho(d_i^T A_i d_i) at one pose, with its gradient and Gauss-Newton Hessian. The
/// parameters are [translation dt; rotation vector w] in x = t + dt + exp([w]x) y, y = R p, so that
/// J_i = [I, -[y_i]x].
struct NormalEquations {
  double value = 0.0;
  Vector6 gradient = Vector6::Zero();
  /// Sum of w_i J_i^T A_i J_i. `add` sums only the blocks on and above the diagonal; `symmetrize`
  /// fills in the rest.
  Matrix6 hessian = Matrix6::Zero();
  std::size_t matched = 0;

  /// Adds one match with d = x - q. @param Ad  A d  @param y  R p  @param w  rho'
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

/// The Gauss-Newton step, shortened to the limits; none if the equations cannot be solved. The step
/// is almost zero in directions that the matches leave open.
[[nodiscard]] std::optional<Vector6> gauss_newton_step(const NormalEquations& at,
                                                       const StepOptions& options);

/// Takes Gauss-Newton steps until one is negligible. Matches are searched for again at each pose.
/// @param at_start   the equations at `start`
/// @param settled    number of steps after which `linearize` no longer depends on their number
/// @param linearize  returns the equations for a pose and the number of steps taken so far
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
