#include "view/leverage.hpp"

#include <Eigen/Cholesky>
#include <cstddef>

namespace vantage::view {
namespace {

using Matrix6 = Eigen::Matrix<double, 6, 6>;

Matrix6 hessian_of(const Pull& pull) {
  Matrix6 hessian;
  std::size_t k = 0;
  for (Eigen::Index row = 0; row < 6; ++row) {
    for (Eigen::Index column = row; column < 6; ++column, ++k) {
      hessian(row, column) = hessian(column, row) = static_cast<double>(pull.hessian[k]);
    }
  }
  return hessian;
}

}  // namespace

std::vector<double> leverages_of(std::span<const Pull> pulls) {
  Matrix6 sum = Matrix6::Zero();
  for (const Pull& pull : pulls) sum += hessian_of(pull);
  const Eigen::LLT<Matrix6> cholesky(sum);
  std::vector<double> leverages;
  if (cholesky.info() != Eigen::Success) return leverages;
  const Matrix6 inverse = cholesky.solve(Matrix6::Identity());
  leverages.reserve(pulls.size());
  for (const Pull& pull : pulls) {
    leverages.push_back(inverse.cwiseProduct(hessian_of(pull)).sum());
  }
  return leverages;
}

}  // namespace vantage::view
