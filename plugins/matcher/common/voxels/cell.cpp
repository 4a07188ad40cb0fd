#include "cell.hpp"

#include <Eigen/Eigenvalues>
#include <algorithm>
#include <cmath>

namespace vantage::ndt {
namespace {

// Below a millionth of the edge, the spread is rounding of the coordinates, not shape.
constexpr double kLeastVariance = 1e-12;

/// The covariance with its eigenvalues raised; no value if all points coincide.
std::optional<Eigen::Matrix3d> raised_covariance(const Moments& m, const Eigen::Vector3d& mean,
                                                 double eigenvalue_floor) {
  const double n = m.count();
  const Eigen::Matrix3d covariance = (m.sum_of_squares() - n * mean * mean.transpose()) / (n - 1.0);

  Eigen::SelfAdjointEigenSolver<Eigen::Matrix3d> solver;
  solver.computeDirect(covariance);
  const double largest = solver.eigenvalues().z();
  if (!(largest > kLeastVariance)) return std::nullopt;
  const double least = eigenvalue_floor * largest;
  if (solver.eigenvalues().x() >= least) return covariance;
  const Eigen::Matrix3d& v = solver.eigenvectors();
  return v * solver.eigenvalues().cwiseMax(least).asDiagonal() * v.transpose();
}

/// The lower triangular L of a positive definite A = L L^T. `least` replaces a pivot that rounding
/// has made non-positive.
Eigen::Matrix3d root_of(const Eigen::Matrix3d& A, double least) {
  const auto pivot = [&](double squared) { return std::sqrt(std::max(squared, least)); };
  Eigen::Matrix3d L = Eigen::Matrix3d::Zero();
  L(0, 0) = pivot(A(0, 0));
  L(1, 0) = A(1, 0) / L(0, 0);
  L(2, 0) = A(2, 0) / L(0, 0);
  L(1, 1) = pivot(A(1, 1) - L(1, 0) * L(1, 0));
  L(2, 1) = (A(2, 1) - L(2, 0) * L(1, 0)) / L(1, 1);
  L(2, 2) = pivot(A(2, 2) - L(2, 0) * L(2, 0) - L(2, 1) * L(2, 1));
  return L;
}

std::uint16_t to_unsigned(double x, double least) {
  return static_cast<std::uint16_t>(std::clamp(x, least, 65535.0));
}
std::int16_t to_signed(double x) {
  return static_cast<std::int16_t>(std::clamp(std::nearbyint(x), -32767.0, 32767.0));
}

}  // namespace

void Moments::add(const Cell& cell, const Eigen::Vector3d& upper) noexcept {
  const double n = cell.points;
  const double d = 0.5 * std::ldexp(1.0 / 65536.0, -int{cell.exponent});  // edges become halves
  Eigen::Matrix3d L = Eigen::Matrix3d::Zero();
  L.diagonal() << d * cell.diagonal[0], d * cell.diagonal[1], d * cell.diagonal[2];
  L(1, 0) = 2.0 * d * cell.lower[0];
  L(2, 0) = 2.0 * d * cell.lower[1];
  L(2, 1) = 2.0 * d * cell.lower[2];
  const Eigen::Vector3d mean(0.5 * ((cell.mean[0] + 0.5) / 65536.0 + upper.x()) - 0.5,
                             0.5 * ((cell.mean[1] + 0.5) / 65536.0 + upper.y()) - 0.5,
                             0.5 * ((cell.mean[2] + 0.5) / 65536.0 + upper.z()) - 0.5);
  const Eigen::Matrix3d squares = (n - 1.0) * (L * L.transpose()) + n * (mean * mean.transpose());
  xy_ += Pair{n * mean.x(), n * mean.y()};
  z_n_ += Pair{n * mean.z(), n};
  xx_xy_ += Pair{squares(0, 0), squares(0, 1)};
  xz_yy_ += Pair{squares(0, 2), squares(1, 1)};
  yz_zz_ += Pair{squares(1, 2), squares(2, 2)};
}

std::optional<Cell> cell_of(const Moments& m, double eigenvalue_floor) {
  const Eigen::Vector3d mean = m.sum() / m.count();
  const auto covariance = raised_covariance(m, mean, eigenvalue_floor);
  if (!covariance) return std::nullopt;
  const double largest = covariance->diagonal().maxCoeff();
  const Eigen::Matrix3d L = root_of(*covariance, 1e-12 * largest);

  Cell cell{.points = m.points()};
  int exponent = 0;
  (void)std::frexp(std::sqrt(largest), &exponent);  // < 2^exponent
  cell.exponent = static_cast<std::uint8_t>(std::clamp(-exponent, 0, int{Cell::kMaxExponent}));
  const double scale = std::ldexp(1.0, cell.exponent);
  for (Eigen::Index i = 0; i < 3; ++i) {
    const auto k = static_cast<std::size_t>(i);
    cell.mean[k] = to_unsigned(std::floor((mean[i] + 0.5) * 65536.0), 0.0);
    cell.diagonal[k] = to_unsigned(std::nearbyint(L(i, i) * scale * 65536.0), 1.0);
  }
  cell.lower = {to_signed(L(1, 0) * scale * 32768.0), to_signed(L(2, 0) * scale * 32768.0),
                to_signed(L(2, 1) * scale * 32768.0)};
  return cell;
}

Gaussian gaussian_of(const Cell& cell) noexcept {
  // L^-1 by substitution, then C = L^-T L^-1: no cancellation in its entries.
  const double scale = std::ldexp(1.0, cell.exponent);
  const double a = scale * 65536.0 / cell.diagonal[0];
  const double b = scale * 65536.0 / cell.diagonal[1];
  const double c = scale * 65536.0 / cell.diagonal[2];
  const double unit = std::ldexp(1.0, -15 - cell.exponent);
  const double l10 = unit * cell.lower[0], l20 = unit * cell.lower[1], l21 = unit * cell.lower[2];
  const double w10 = -l10 * a * b;
  const double w21 = -l21 * b * c;
  const double w20 = -(l20 * a + l21 * w10) * c;
  return {.mean = {(cell.mean[0] + 0.5) / 65536.0, (cell.mean[1] + 0.5) / 65536.0,
                   (cell.mean[2] + 0.5) / 65536.0},
          .xx = a * a + w10 * w10 + w20 * w20,
          .xy = w10 * b + w20 * w21,
          .xz = w20 * c,
          .yy = b * b + w21 * w21,
          .yz = w21 * c,
          .zz = c * c};
}

}  // namespace vantage::ndt
