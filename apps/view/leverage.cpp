#include "view/leverage.hpp"

#include <Eigen/Cholesky>

#include "vantage/kit/pull_term.hpp"

namespace vantage::view {
namespace {

using Matrix6 = Eigen::Matrix<double, 6, 6>;

Matrix6 in_double(const Pull& pull) { return hessian_of(pull).cast<double>(); }

}  // namespace

std::vector<double> leverages_of(std::span<const Pull> pulls) {
  Matrix6 sum = Matrix6::Zero();
  for (const Pull& pull : pulls) sum += in_double(pull);
  const Eigen::LLT<Matrix6> cholesky(sum);
  std::vector<double> leverages;
  if (cholesky.info() != Eigen::Success) return leverages;
  const Matrix6 inverse = cholesky.solve(Matrix6::Identity());
  leverages.reserve(pulls.size());
  for (const Pull& pull : pulls) {
    leverages.push_back(inverse.cwiseProduct(in_double(pull)).sum());
  }
  return leverages;
}

}  // namespace vantage::view
