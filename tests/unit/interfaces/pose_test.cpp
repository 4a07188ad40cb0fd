#include <doctest/doctest.h>

#include <cmath>
#include <random>

#include "vantage/pose.hpp"

using namespace vantage;

namespace {
Pose random_pose(std::mt19937& random) {
  std::uniform_real_distribution<double> u(-3.0, 3.0);
  return pose_from_xyz_rpy({u(random), u(random), u(random)},
                           {u(random), u(random) / 2, u(random)});
}
}  // namespace

TEST_CASE("a pose times its inverse is the identity, and composing equals applying twice") {
  std::mt19937 random(1);
  for (int i = 0; i < 50; ++i) {
    const Pose a = random_pose(random), b = random_pose(random);
    const Point p(1, -2, 3);
    CHECK(((a * a.inverse()) * p - p).norm() < 1e-12);
    CHECK(((a * b) * p - a * (b * p)).norm() < 1e-12);
    CHECK(is_valid(a * b));
  }
}

TEST_CASE("fixed-axis angles: yaw turns x to y, applied last") {
  const Pose yaw = pose_from_xyz_rpy({0, 0, 0}, {0, 0, M_PI / 2});
  CHECK((yaw * Point(1, 0, 0) - Point(0, 1, 0)).norm() < 1e-12);
  const Pose both = pose_from_xyz_rpy({1, 2, 3}, {M_PI / 2, 0, M_PI / 2});
  // roll: y -> z; then yaw leaves z alone
  CHECK((both * Point(0, 1, 0) - Point(1, 2, 4)).norm() < 1e-12);
}

TEST_CASE("rotation vectors and rotation_between agree, also for tiny angles") {
  for (const double angle : {0.0, 1e-9, 1e-7, 1e-3, 1.0, 3.0}) {
    Pose turned;
    turned.rotation = rotation_from_vector(Eigen::Vector3d(0, 0, angle));
    CHECK(rotation_between(Pose{}, turned) == doctest::Approx(angle).epsilon(1e-9));
  }
}

TEST_CASE("is_valid refuses what is no rigid transform") {
  Pose pose;
  CHECK(is_valid(pose));
  pose.translation.x() = std::nan("");
  CHECK_FALSE(is_valid(pose));
  pose = {};
  pose.rotation.w() = 2.0;
  CHECK_FALSE(is_valid(pose));
}
