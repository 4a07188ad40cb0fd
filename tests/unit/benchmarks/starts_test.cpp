#include "starts.hpp"

#include <doctest/doctest.h>

#include <cmath>
#include <numbers>

namespace vantage::benchmarks {
namespace {

constexpr double kDegree = std::numbers::pi / 180.0;
const Pose kReference = pose_from_xyz_rpy({10.0, -4.0, 1.0}, {0.02, -0.03, 2.0});

TEST_CASE("a start that is not off is the reference") {
  const auto all = starts(kReference, {}, 8);
  REQUIRE(all.size() == 1);
  CHECK(all[0].translation == kReference.translation);
  CHECK(rotation_between(all[0], kReference) == doctest::Approx(0.0));
}

TEST_CASE("starts are as far off as asked, in the plane and about the vertical") {
  const auto all = starts(kReference, {.metres = 1.5, .degrees = 5.0}, 8);
  REQUIRE(all.size() == 8);
  Point sum = Point::Zero();
  double turned = 0.0;
  for (const Pose& start : all) {
    const Point moved = start.translation - kReference.translation;
    CHECK(moved.norm() == doctest::Approx(1.5));
    CHECK(moved.z() == 0.0);
    CHECK(rotation_between(start, kReference) == doctest::Approx(5.0 * kDegree));
    sum += moved;
    const Eigen::AngleAxisd turn(
        Eigen::Quaterniond(start.rotation * kReference.rotation.conjugate()).normalized());
    CHECK(std::abs(turn.axis().z()) == doctest::Approx(1.0));
    turned += turn.angle() * turn.axis().z();
  }
  CHECK(sum.norm() == doctest::Approx(0.0));
  CHECK(turned == doctest::Approx(0.0));  // as many to the left as to the right
}

TEST_CASE("the first of the directions is where the sensor faces") {
  const auto all = starts(pose_from_xyz_rpy(Point::Zero(), {0.0, 0.0, 2.0}), {.metres = 1.0}, 4);
  CHECK(all[0].translation.x() == doctest::Approx(std::cos(2.0)));
  CHECK(all[0].translation.y() == doctest::Approx(std::sin(2.0)));
}

TEST_CASE("a start that is only turned is turned to either side") {
  const auto all = starts(kReference, {.degrees = 10.0}, 8);
  REQUIRE(all.size() == 2);
  CHECK(rotation_between(all[0], all[1]) == doctest::Approx(20.0 * kDegree));
}

}  // namespace
}  // namespace vantage::benchmarks
