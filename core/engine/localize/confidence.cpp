#include "vantage/engine/confidence.hpp"

#include <Eigen/Eigenvalues>
#include <cmath>
#include <numbers>

namespace vantage {
namespace {

// A direction known worse than this counts as degenerate. It is also the unit in which metres and
// radians compare, so it is no threshold of a user: the covariance says the same in numbers.
constexpr double kVagueMetres = 0.5;
constexpr double kVagueRadians = 5.0 * std::numbers::pi / 180.0;

using Matrix6 = Eigen::Matrix<double, 6, 6>;

}  // namespace

PoseConfidence confidence_of(const Alignment& alignment, double scale) {
  // In units of the limits, metres and radians can be compared: an eigenvalue below 1 belongs to a
  // direction that is known less well than its limit. A direction about which nothing is known gets
  // a large variance, not an infinite one.
  Eigen::Matrix<double, 6, 1> limits;
  limits << Eigen::Vector3d::Constant(kVagueMetres), Eigen::Vector3d::Constant(kVagueRadians);
  const Matrix6 information =
      limits.asDiagonal() * Matrix6(alignment.hessian / scale) * limits.asDiagonal();
  const Eigen::SelfAdjointEigenSolver<Matrix6> known(information);
  constexpr double kUnknown = 1e-4;  // variance of 10^4 limits squared: 50 m, 500 degrees
  const Matrix6 covariance = known.eigenvectors() *
                             known.eigenvalues().cwiseMax(kUnknown).cwiseInverse().asDiagonal() *
                             known.eigenvectors().transpose();

  PoseConfidence confidence;
  confidence.covariance = limits.asDiagonal() * covariance * limits.asDiagonal();
  confidence.degenerate = static_cast<std::uint32_t>((known.eigenvalues().array() < 1.0).count());
  const auto axes = [&](Eigen::Index first) {
    const Eigen::Matrix3d block = confidence.covariance.block<3, 3>(first, first);
    return Eigen::SelfAdjointEigenSolver<Eigen::Matrix3d>(block);
  };
  const auto translation = axes(0), rotation = axes(3);
  confidence.sigma_translation = translation.eigenvalues().cwiseMax(0.0).cwiseSqrt().reverse();
  confidence.sigma_rotation = rotation.eigenvalues().cwiseMax(0.0).cwiseSqrt().reverse();
  confidence.weakest_direction = translation.eigenvectors().col(2);
  return confidence;
}

}  // namespace vantage
