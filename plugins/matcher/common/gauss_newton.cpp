#include "gauss_newton.hpp"

#include <Eigen/Cholesky>

namespace vantage::matching {

std::optional<Vector6> gauss_newton_step(const NormalEquations& at, const StepOptions& options) {
  const Eigen::LLT<Matrix6> root(ridged(at.hessian));
  if (root.info() != Eigen::Success) return std::nullopt;
  return shortened(-root.solve(at.gradient), options);
}

}  // namespace vantage::matching
