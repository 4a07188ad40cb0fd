#pragma once

#include <array>
#include <cmath>
#include <cstddef>
#include <limits>

#include "vantage/map_element.hpp"

namespace vantage::contribution {

/// A rotation counts like a translation this far from the sensor [m]. W of the squared error is 1
/// for translations and the square of this for rotations.
inline constexpr double kArm = 10.0;

/// What some elements together do to the pose of one scan: gradient and Hessian of their objective
/// at the true pose, with rotations in units of 1 / kArm.
struct Sum {
  std::array<double, 6> gradient{};
  std::array<double, Pull::kUpper> hessian{};  ///< upper triangle, row by row
};

inline Sum operator+(const Sum& a, const Sum& b) noexcept {
  Sum sum;
  for (std::size_t i = 0; i < sum.gradient.size(); ++i)
    sum.gradient[i] = a.gradient[i] + b.gradient[i];
  for (std::size_t i = 0; i < sum.hessian.size(); ++i) sum.hessian[i] = a.hessian[i] + b.hessian[i];
  return sum;
}

inline Sum sum_of(const Pull& pull) noexcept {
  const auto unit = [](std::size_t row) { return row < 3 ? 1.0 : 1.0 / kArm; };
  Sum sum;
  for (std::size_t row = 0, k = 0; row < 6; ++row) {
    sum.gradient[row] = unit(row) * static_cast<double>(pull.gradient[row]);
    for (std::size_t column = row; column < 6; ++column, ++k) {
      sum.hessian[k] = unit(row) * unit(column) * static_cast<double>(pull.hessian[k]);
    }
  }
  return sum;
}

/// The expected squared error of the pose that the elements give [m^2]: |H^-1 g|^2 of the place to
/// which they pull it, plus `noise` times the trace of H^-1. Infinite if they do not hold it.
inline double squared_error(const Sum& sum, double noise) noexcept {
  // H = L L^T; rows of L^-1.
  double L[6][6], inverse[6][6] = {}, y[6];
  for (std::size_t column = 0, k = 0; column < 6; ++column) {
    for (std::size_t row = column; row < 6; ++row, ++k) {
      double x = sum.hessian[k];
      for (std::size_t i = 0; i < column; ++i) x -= L[row][i] * L[column][i];
      if (row == column) {
        if (!(x > 0.0)) return std::numeric_limits<double>::infinity();
        L[row][row] = std::sqrt(x);
      } else {
        L[row][column] = x / L[column][column];
      }
    }
  }
  double spread = 0.0;
  for (std::size_t row = 0; row < 6; ++row) {
    const double over = 1.0 / L[row][row];
    inverse[row][row] = over;
    for (std::size_t column = 0; column < row; ++column) {
      double x = 0.0;
      for (std::size_t i = column; i < row; ++i) x += L[row][i] * inverse[i][column];
      inverse[row][column] = -x * over;
    }
    for (std::size_t column = 0; column <= row; ++column) {
      spread += inverse[row][column] * inverse[row][column];
    }
  }
  for (std::size_t row = 0; row < 6; ++row) {
    y[row] = 0.0;
    for (std::size_t i = 0; i <= row; ++i) y[row] += inverse[row][i] * sum.gradient[i];
  }
  double bias = 0.0;
  for (std::size_t column = 0; column < 6; ++column) {
    double x = 0.0;
    for (std::size_t row = column; row < 6; ++row) x += inverse[row][column] * y[row];
    bias += x * x;
  }
  return bias + noise * spread;
}

}  // namespace vantage::contribution
