#pragma once

#include <Eigen/Core>
#include <cmath>
#include <limits>
#include <span>

#include "vantage/kit/pull_term.hpp"
#include "vantage/map_element.hpp"

namespace vantage {

/// How far off the pose is that some elements give a scan: -H^-1 g is its bias, H^-1 its covariance
/// but for a factor, where H and g are the sums of their Hessians and gradients.
class PoseError {
  using Vector6 = Eigen::Matrix<float, 6, 1>;
  using Matrix6 = Eigen::Matrix<float, 6, 6>;

 public:
  /// The factor of the covariance for objectives as that of `ndt`.
  static constexpr float kNoise = 0.1F;

  /// @param noise  the factor of the covariance
  /// @param prior  diagonal of H before the first element; 0: nothing is known
  PoseError(float noise, double prior) : noise_(noise) {
    sum_.hessian = prior * Eigen::Matrix<double, 6, 6>::Identity();
    solve();
  }

  void add(const PullTerm& term) {
    sum_ = sum_with(term);
    solve();
  }
  void add(std::span<const Pull> pulls) {
    for (const Pull& pull : pulls) sum_ = sum_with(term_of(pull));
    solve();
  }

  /// The expected squared error of the pose [m^2]: the squared bias, and `noise` times the trace of
  /// the covariance. Infinite if the elements do not hold the pose.
  [[nodiscard]] float squared() const noexcept { return squared_; }

  /// The same of the position alone.
  [[nodiscard]] float squared_translation() const noexcept {
    if (!(squared_ < std::numeric_limits<float>::infinity())) return squared_;
    return bias_.head<3>().squaredNorm() + noise_ * inverse_.diagonal().head<3>().sum();
  }

  /// `squared` with one element more.
  [[nodiscard]] float squared_with(const PullTerm& term) const noexcept {
    const Sum sum = sum_with(term);
    Triangle inverse;
    return inverse.invert(sum.hessian) ? squared(inverse, inverse.solve(sum.gradient))
                                       : std::numeric_limits<float>::infinity();
  }
  /// Nearly the same, and faster: the Hessian of the element counts as one of rank 1 (Sherman and
  /// Morrison, 1950). Good for an element that adds little.
  [[nodiscard]] float nearly_squared_with(const PullTerm& term) const noexcept {
    const float damping = 1.0F / (1.0F + inverse_.cwiseProduct(term.hessian).sum());
    const Vector6 change = inverse_ * (term.gradient - term.hessian * bias_);
    const Vector6 bias = bias_ + change - damping * (inverse_ * (term.hessian * change));
    const float spread = trace_ - damping * inverse_squared_.cwiseProduct(term.hessian).sum();
    return bias.squaredNorm() + noise_ * spread;
  }

 private:
  struct Sum {
    Eigen::Matrix<double, 6, 6> hessian;
    Eigen::Matrix<double, 6, 1> gradient = Eigen::Matrix<double, 6, 1>::Zero();
  };

  /// L^-1 of H = L L^T.
  struct Triangle {
    double at[6][6] = {};  // the lower triangle

    /// False if H is not positive definite.
    bool invert(const Eigen::Matrix<double, 6, 6>& hessian) noexcept {
      double L[6][6];
      for (int column = 0; column < 6; ++column) {
        for (int row = column; row < 6; ++row) {
          double x = hessian(row, column);
          for (int i = 0; i < column; ++i) x -= L[row][i] * L[column][i];
          if (row > column) {
            L[row][column] = x * at[column][column];
          } else if (!(x > 0.0)) {
            return false;
          } else {
            at[row][row] = 1.0 / std::sqrt(x);
          }
        }
      }
      for (int row = 0; row < 6; ++row) {
        for (int column = 0; column < row; ++column) {
          double x = 0.0;
          for (int i = column; i < row; ++i) x += L[row][i] * at[i][column];
          at[row][column] = -x * at[row][row];
        }
      }
      return true;
    }
    [[nodiscard]] double squared_norm() const noexcept {
      double sum = 0.0;
      for (int row = 0; row < 6; ++row) {
        for (int column = 0; column <= row; ++column) sum += at[row][column] * at[row][column];
      }
      return sum;
    }
    /// H^-1 v.
    [[nodiscard]] Eigen::Matrix<double, 6, 1> solve(
        const Eigen::Matrix<double, 6, 1>& v) const noexcept {
      Eigen::Matrix<double, 6, 1> half = Eigen::Matrix<double, 6, 1>::Zero(), x = half;
      for (int row = 0; row < 6; ++row) {
        for (int column = 0; column <= row; ++column) half[row] += at[row][column] * v[column];
      }
      for (int row = 0; row < 6; ++row) {
        for (int column = 0; column <= row; ++column) x[column] += at[row][column] * half[row];
      }
      return x;
    }
  };

  [[nodiscard]] Sum sum_with(const PullTerm& term) const noexcept {
    return {sum_.hessian + term.hessian.cast<double>(),
            sum_.gradient + term.gradient.cast<double>()};
  }
  [[nodiscard]] float squared(const Triangle& inverse,
                              const Eigen::Matrix<double, 6, 1>& bias) const noexcept {
    return static_cast<float>(bias.squaredNorm() +
                              static_cast<double>(noise_) * inverse.squared_norm());
  }

  void solve() noexcept {
    Triangle inverse;
    if (!inverse.invert(sum_.hessian)) {
      squared_ = std::numeric_limits<float>::infinity();
      return;
    }
    const Eigen::Matrix<double, 6, 1> bias = inverse.solve(sum_.gradient);
    squared_ = squared(inverse, bias);
    bias_ = bias.cast<float>();
    Eigen::Matrix<double, 6, 6> covariance;
    for (int k = 0; k < 6; ++k) {
      covariance.col(k) = inverse.solve(Eigen::Matrix<double, 6, 1>::Unit(k));
    }
    inverse_ = covariance.cast<float>();
    inverse_squared_ = (covariance * covariance).cast<float>();
    trace_ = inverse_.trace();
  }

  Sum sum_;
  Matrix6 inverse_ = Matrix6::Zero(), inverse_squared_ = Matrix6::Zero();
  Vector6 bias_ = Vector6::Zero();
  float noise_, trace_ = 0.0F, squared_ = 0.0F;
};

}  // namespace vantage
