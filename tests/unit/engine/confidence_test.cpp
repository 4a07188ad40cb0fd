#include "vantage/engine/confidence.hpp"

#include <doctest/doctest.h>

#include <cmath>

using namespace vantage;

namespace {

Alignment with_information(const Eigen::Matrix<double, 6, 1>& diagonal) {
  Alignment alignment;
  alignment.hessian = Alignment::Hessian(diagonal.asDiagonal());
  return alignment;
}

}  // namespace

TEST_CASE("the covariance is the scaled inverse of the Hessian") {
  Alignment alignment;
  Eigen::Matrix<double, 6, 6> root;
  for (int i = 0; i < 6; ++i) {
    for (int j = 0; j < 6; ++j) root(i, j) = 40.0 * (i == j) + std::sin(3.0 * i + j);
  }
  alignment.hessian = root * root.transpose();
  const PoseConfidence confidence = confidence_of(covariance_of(alignment, 100, 0.005));
  const Eigen::Matrix<double, 6, 6> identity = confidence.covariance * alignment.hessian / 4.0;
  CHECK((identity - Eigen::Matrix<double, 6, 6>::Identity()).norm() < 1e-9);
  CHECK(confidence.degenerate == 0);
}

TEST_CASE("standard deviations come largest first, along their own axes") {
  Eigen::Matrix<double, 6, 1> information;
  information << 1e4, 25, 1e6, 1e4, 1e6, 1e8;
  const PoseConfidence confidence =
      confidence_of(covariance_of(with_information(information), 300, 0.001));
  CHECK((confidence.sigma_translation - Eigen::Vector3d(0.2, 0.01, 0.001)).norm() < 1e-12);
  CHECK((confidence.sigma_rotation - Eigen::Vector3d(1e-2, 1e-3, 1e-4)).norm() < 1e-12);
  CHECK(std::abs(confidence.weakest_direction.y()) == doctest::Approx(1.0));
  CHECK(confidence.degenerate == 0);
}

TEST_CASE("directions the scan says nothing of are counted and get a large variance") {
  Eigen::Matrix<double, 6, 1> information;
  information << 0, 1e4, 1e4, 1e6, 1e6, -3;  // a curvature of the wrong sign is no knowledge either
  const PoseConfidence confidence =
      confidence_of(covariance_of(with_information(information), 300, 0.001));
  CHECK(confidence.degenerate == 2);
  CHECK(confidence.covariance.allFinite());
  CHECK(confidence.sigma_translation[0] > 10.0);
  CHECK(confidence.sigma_translation[1] == doctest::Approx(0.01));
  CHECK(std::abs(confidence.weakest_direction.x()) == doctest::Approx(1.0));
  CHECK(confidence_of(
            covariance_of(with_information(Eigen::Matrix<double, 6, 1>::Zero()), 300, 0.001))
            .degenerate == 6);
}

TEST_CASE("more points in the same places make a pose hardly surer, but a few points are vague") {
  const Eigen::Matrix<double, 6, 1> information = Eigen::Matrix<double, 6, 1>::Constant(1e4);
  const auto variance_of = [&](std::size_t points) {
    const double n = static_cast<double>(points);
    return covariance_of(with_information(n / 100.0 * information), points, 0.01)(0, 0);
  };
  CHECK(variance_of(100'000) > 0.93 * variance_of(10'000));
  CHECK(variance_of(100) > 4.0 * variance_of(1000));
}
