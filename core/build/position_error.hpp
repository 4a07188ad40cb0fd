#pragma once

#include <Eigen/Cholesky>
#include <Eigen/Core>
#include <limits>

#include "vantage/kit/pull_term.hpp"

namespace vantage {

/// How far off the position is that some elements give a scan: -H^-1 g is the bias of the pose, and
/// H^-1 its covariance but for a factor, where H and g are the sums of their Hessians and
/// gradients.
class PositionError {
 public:
  void add(const PullTerm& term) {
    hessian_ += term.hessian.cast<double>();
    gradient_ += term.gradient.cast<double>();
  }

  /// The expected squared error [m^2]; infinite if the elements do not hold the pose.
  [[nodiscard]] double squared() const {
    // The factor. It also covers the bias at other places, of which the bias at this one says
    // nothing. Chosen with `ndt` on the demo's campus, where errors are then as predicted.
    constexpr double kNoise = 0.31;
    const Eigen::LLT<Matrix6> factored(hessian_);
    if (factored.info() != Eigen::Success) return std::numeric_limits<double>::infinity();
    const Vector6 bias = factored.solve(gradient_);
    const Matrix6 covariance = factored.solve(Matrix6::Identity());
    return bias.head<3>().squaredNorm() + kNoise * covariance.diagonal().head<3>().sum();
  }

 private:
  using Vector6 = Eigen::Matrix<double, 6, 1>;
  using Matrix6 = Eigen::Matrix<double, 6, 6>;
  Matrix6 hessian_ = Matrix6::Zero();
  Vector6 gradient_ = Vector6::Zero();
};

}  // namespace vantage
