#pragma once

#include <Eigen/Core>
#include <cstddef>

#include "vantage/map_element.hpp"

namespace vantage {

/// What one element does to the pose of one scan: gradient and Hessian of its term of the objective
/// at the true pose, with rotations in units of 1 / kArm.
struct PullTerm {
  /// A rotation counts like a translation this far from the sensor [m].
  static constexpr float kArm = 10.0F;

  Eigen::Matrix<float, 6, 6> hessian;
  Eigen::Matrix<float, 6, 1> gradient;
};

/// The whole Hessian of a pull, in its own units.
inline Eigen::Matrix<float, 6, 6> hessian_of(const Pull& pull) noexcept {
  Eigen::Matrix<float, 6, 6> hessian;
  std::size_t k = 0;
  for (Eigen::Index row = 0; row < 6; ++row) {
    for (Eigen::Index column = row; column < 6; ++column, ++k) {
      hessian(row, column) = hessian(column, row) = pull.hessian[k];
    }
  }
  return hessian;
}

inline PullTerm term_of(const Pull& pull) noexcept {
  Eigen::Matrix<float, 6, 1> unit;
  unit << 1.0F, 1.0F, 1.0F, Eigen::Vector3f::Constant(1.0F / PullTerm::kArm);
  return {.hessian = (unit * unit.transpose()).cwiseProduct(hessian_of(pull)),
          .gradient = unit.cwiseProduct(
              Eigen::Map<const Eigen::Matrix<float, 6, 1>>(pull.gradient.data()))};
}

}  // namespace vantage
