#include "vantage/track/rotation.hpp"

#include <doctest/doctest.h>

#include <cmath>

using namespace vantage;

TEST_CASE("interpolation: ends, middle, beyond, and the short way round") {
  const Pose a = pose_from_xyz_rpy({0, 0, 0}, {0, 0, 3.0});
  const Pose b = pose_from_xyz_rpy({2, 0, 0}, {0, 0, -3.0});
  CHECK(rotation_between(interpolate(a, b, 0.0), a) < 1e-12);
  CHECK(rotation_between(interpolate(a, b, 1.0), b) < 1e-12);
  const double short_way = 2.0 * M_PI - 6.0;
  CHECK(rotation_between(a, interpolate(a, b, 0.5)) == doctest::Approx(short_way / 2));
  CHECK(interpolate(a, b, 2.0).translation.x() == doctest::Approx(4.0));
}
