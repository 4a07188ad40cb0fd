#include "vantage/engine/confidence.hpp"

#include <Eigen/Eigenvalues>
#include <numbers>

namespace vantage {
namespace {

// A direction known worse than this counts as degenerate. It is also the unit in which metres and
// radians compare, so it is no threshold of a user: the covariance says the same in numbers.
constexpr double kVagueMetres = 0.5;
constexpr double kVagueRadians = 5.0 * std::numbers::pi / 180.0;

using Matrix6 = Eigen::Matrix<double, 6, 6>;

Eigen::Matrix<double, 6, 1> limits() {
  Eigen::Matrix<double, 6, 1> limits;
  limits << Eigen::Vector3d::Constant(kVagueMetres), Eigen::Vector3d::Constant(kVagueRadians);
  return limits;
}

}  // namespace

Alignment::Hessian covariance_of(const Alignment& alignment, std::size_t points, double scale) {
  // In units of the limits, metres and radians can be compared.
  constexpr double kPointsApart = 700.0;  // chosen on the recorded street
  const double one = scale * (static_cast<double>(points) + kPointsApart);
  const Matrix6 information =
      limits().asDiagonal() * Matrix6(alignment.hessian / one) * limits().asDiagonal();
  const Eigen::SelfAdjointEigenSolver<Matrix6> known(information);
  constexpr double kUnknown = 1e-4;  // variance of 10^4 limits squared
  const Matrix6 covariance = known.eigenvectors() *
                             known.eigenvalues().cwiseMax(kUnknown).cwiseInverse().asDiagonal() *
                             known.eigenvectors().transpose();
  return limits().asDiagonal() * covariance * limits().asDiagonal();
}

PoseConfidence confidence_of(const Alignment::Hessian& covariance) {
  PoseConfidence confidence;
  confidence.covariance = covariance;
  const Matrix6 vague = limits().cwiseInverse().asDiagonal() * Matrix6(covariance) *
                        limits().cwiseInverse().asDiagonal();
  const Eigen::SelfAdjointEigenSolver<Matrix6> directions(vague, Eigen::EigenvaluesOnly);
  confidence.degenerate =
      static_cast<std::uint32_t>((directions.eigenvalues().array() > 1.0).count());
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
