#include "view/leverage.hpp"

#include <doctest/doctest.h>

#include <Eigen/Core>
#include <cstddef>
#include <numeric>
#include <random>

using namespace vantage;
using namespace vantage::view;

namespace {

using Matrix6 = Eigen::Matrix<double, 6, 6>;

Pull pull_of(const Matrix6& hessian) {
  Pull pull;
  std::size_t k = 0;
  for (Eigen::Index row = 0; row < 6; ++row) {
    for (Eigen::Index column = row; column < 6; ++column) {
      pull.hessian[k++] = static_cast<float>(hessian(row, column));
    }
  }
  return pull;
}

/// Hessians of points that are held along one direction each.
std::vector<Matrix6> some_hessians() {
  std::mt19937 random(3);
  std::uniform_real_distribution<double> anything(-1.0, 1.0);
  std::vector<Matrix6> hessians;
  for (int i = 0; i < 40; ++i) {
    Eigen::Matrix<double, 6, 1> row;
    for (double& x : row) x = anything(random);
    row.tail<3>() *= 30.0;  // an arm [m]
    hessians.push_back(row * row.transpose());
  }
  return hessians;
}

std::vector<Pull> pulls_of(const std::vector<Matrix6>& hessians) {
  std::vector<Pull> pulls;
  for (const Matrix6& hessian : hessians) pulls.push_back(pull_of(hessian));
  return pulls;
}

}  // namespace

TEST_CASE("the degrees of freedom are shared out; what alone holds a direction has all of it") {
  std::vector<Pull> pulls;
  for (Eigen::Index axis = 0; axis < 6; ++axis) {
    Matrix6 along = Matrix6::Zero();
    along(axis, axis) = 5.0 * static_cast<double>(axis + 1);
    pulls.push_back(pull_of(along));
  }
  for (const double leverage : leverages_of(pulls)) CHECK(leverage == doctest::Approx(1.0));
  Matrix6 same = Matrix6::Zero();  // as the first, three times as strong
  same(0, 0) = 15.0;
  pulls.push_back(pull_of(same));
  const auto leverages = leverages_of(pulls);
  CHECK(leverages.front() == doctest::Approx(0.25));
  CHECK(leverages.back() == doctest::Approx(0.75));
  CHECK(std::accumulate(leverages.begin(), leverages.end(), 0.0) == doctest::Approx(kFreedom));
}

TEST_CASE("leverages do not depend on the unit of rotations or on the noise") {
  auto hessians = some_hessians();
  const auto leverages = leverages_of(pulls_of(hessians));
  REQUIRE(leverages.size() == hessians.size());
  CHECK(std::accumulate(leverages.begin(), leverages.end(), 0.0) == doctest::Approx(kFreedom));
  Matrix6 units = Matrix6::Identity();
  units.diagonal().tail<3>().setConstant(0.1);
  for (Matrix6& hessian : hessians) hessian = 7.0 * units * hessian * units;
  const auto in_other_units = leverages_of(pulls_of(hessians));
  for (std::size_t i = 0; i < leverages.size(); ++i) {
    CHECK(leverages[i] > 0.0);
    CHECK(leverages[i] < 1.0);
    CHECK(in_other_units[i] == doctest::Approx(leverages[i]).epsilon(1e-4));
  }
}

TEST_CASE("an element may take away; the rest still adds up") {
  auto hessians = some_hessians();
  hessians.push_back(-0.5 * hessians.front());
  const auto leverages = leverages_of(pulls_of(hessians));
  REQUIRE(leverages.size() == hessians.size());
  CHECK(leverages.back() == doctest::Approx(-0.5 * leverages.front()).epsilon(1e-4));
  CHECK(std::accumulate(leverages.begin(), leverages.end(), 0.0) == doctest::Approx(kFreedom));
}

TEST_CASE("a pose that the elements do not fix has no leverages") {
  CHECK(leverages_of({}).empty());
  auto hessians = some_hessians();
  hessians.resize(5);
  CHECK(leverages_of(pulls_of(hessians)).empty());
}
