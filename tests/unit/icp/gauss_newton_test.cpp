#include "common/gauss_newton.hpp"

#include <doctest/doctest.h>
#include <Eigen/Eigenvalues>
#include <random>
#include <vector>

#include "common/kernel.hpp"

namespace vantage::matching {
namespace {

struct Pair {
  Point p, q;
  Eigen::Matrix3d A;
};

std::vector<Pair> some_pairs(double noise, std::uint32_t seed) {
  std::mt19937 random(seed);
  std::normal_distribution<double> normal;
  const auto vector = [&] {
    return Eigen::Vector3d(normal(random), normal(random), normal(random));
  };
  std::vector<Pair> pairs;
  for (int i = 0; i < 200; ++i) {
    const Point p = 5.0 * vector();
    Eigen::Matrix3d root;
    root << vector(), vector(), vector();
    pairs.push_back({p, p + noise * vector(), root * root.transpose()});
  }
  return pairs;
}

NormalEquations equations(const std::vector<Pair>& pairs, const Pose& pose,
                          const RobustLoss& loss) {
  NormalEquations sum;
  for (const auto& [p, q, A] : pairs) {
    const Eigen::Vector3d y = pose.rotation.toRotationMatrix() * p;
    const Eigen::Vector3d d = y + pose.translation - q;
    const double s = d.dot(A * d);
    sum.add(A, A * d, y, loss.weight(s), loss.value(s));
  }
  sum.symmetrize();
  return sum;
}

}  // namespace

TEST_CASE("a loss's weight is its derivative, at most 1 and falling") {
  for (const Kernel kernel : {Kernel::geman_mcclure, Kernel::huber, Kernel::none}) {
    const RobustLoss loss{.kernel = kernel, .scale = 1.7};
    CHECK(loss.value(0.0) == 0.0);
    CHECK(loss.weight(0.0) == 1.0);
    double last = 1.0;
    for (double s = 0.05; s < 20.0; s += 0.1) {
      CAPTURE(s);
      const double h = 1e-5;
      const double difference = (loss.value(s + h) - loss.value(s - h)) / (2.0 * h);
      CHECK(loss.weight(s) == doctest::Approx(difference).epsilon(1e-6));
      CHECK(loss.weight(s) <= last);
      last = loss.weight(s);
    }
  }
}

TEST_CASE("the gradient agrees with finite differences, the Hessian where the fit is exact") {
  const Pose pose = pose_from_xyz_rpy({0.1, -0.2, 0.3}, {0.05, 0.02, -0.04});
  for (const Kernel kernel : {Kernel::geman_mcclure, Kernel::huber, Kernel::none}) {
    const RobustLoss loss{.kernel = kernel, .scale = 2.0};
    const auto pairs = some_pairs(0.2, 1);
    const NormalEquations at = equations(pairs, pose, loss);
    const auto exact = some_pairs(0.0, 2);
    const NormalEquations at_exact = equations(exact, Pose{}, loss);
    CHECK(at_exact.gradient.norm() < 1e-9);
    CHECK(at_exact.hessian == at_exact.hessian.transpose());
    for (Eigen::Index axis = 0; axis < 6; ++axis) {
      CAPTURE(axis);
      const double h = 1e-6;
      const Vector6 step = h * Vector6::Unit(axis);
      const double up = equations(pairs, moved(pose, step), loss).value;
      const double down = equations(pairs, moved(pose, -step), loss).value;
      CHECK(at.gradient[axis] == doctest::Approx((up - down) / (2.0 * h)).epsilon(1e-5));
      const Vector6 column = (equations(exact, moved(Pose{}, step), loss).gradient -
                              equations(exact, moved(Pose{}, -step), loss).gradient) /
                             (2.0 * h);
      CHECK((at_exact.hessian.col(axis) - column).norm() < 1e-5 * column.norm());
    }
  }
}

TEST_CASE("what the matches leave open stays as it is") {
  NormalEquations flat;  // of the plane z = 0: x, y and the turn about z are open
  const Eigen::Matrix3d A = Eigen::Vector3d::UnitZ() * Eigen::Vector3d::UnitZ().transpose();
  for (const Eigen::Vector3d& y : {Eigen::Vector3d(1, 0, 0.1), Eigen::Vector3d(-1, 0, 0.1),
                                   Eigen::Vector3d(0, 1, 0.1), Eigen::Vector3d(0, -1, 0.1)}) {
    flat.add(A, A * y, y, 1.0, 0.01);
  }
  flat.symmetrize();
  const auto step = gauss_newton_step(flat, {});
  REQUIRE(step);
  CHECK((*step)[2] == doctest::Approx(-0.1).epsilon(1e-4));
  CHECK(step->head<2>().norm() < 1e-6);
  CHECK(step->tail<3>().norm() < 1e-6);
  CHECK(!gauss_newton_step(NormalEquations{}, {}));
}

}  // namespace vantage::matching
