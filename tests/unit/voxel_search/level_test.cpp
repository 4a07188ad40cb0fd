#include "level.hpp"

#include <doctest/doctest.h>

#include <cmath>
#include <numbers>
#include <random>

using namespace vantage;
using vantage::voxel_search::level_by_ground;

namespace {

constexpr double kDegrees = std::numbers::pi / 180.0;

/// Ground that rolls by 0.2 m, a house front, a tree and stray returns, as seen from 1.5 m above
/// it.
PointCloud yard(const Pose& T_map_scan, bool ground = true) {
  std::mt19937 random(5);
  const auto number = [&](double from, double to) {
    return from + (to - from) * double(random() % 100000) / 1e5;
  };
  PointCloud map;
  if (ground) {
    for (int i = 0; i < 1500; ++i) {
      const double x = number(-25, 25), y = number(-8, 25);
      map.emplace_back(x, y, 0.2 * std::sin(0.3 * x) + number(-0.03, 0.03));
    }
  }
  for (int i = 0; i < 2500; ++i) map.emplace_back(number(-25, 25), -8.0, number(0, 9));
  for (int i = 0; i < 600; ++i) {
    map.emplace_back(6 + number(-2, 2), 8 + number(-2, 2), number(2, 7));
  }
  for (int i = 0; i < 40; ++i) map.emplace_back(number(-9, 9), number(-7, 9), number(-4, -0.5));
  for (Point& p : map) p = T_map_scan.inverse() * p;
  return map;
}

double tilt_of(const Pose& pose) {
  return std::acos(std::min(1.0, pose.rotation.toRotationMatrix()(2, 2))) / kDegrees;
}

}  // namespace

TEST_CASE("a scan is levelled by the ground that it shows, whatever stands around") {
  for (double roll = -25.0; roll <= 25.0; roll += 12.5) {
    for (double pitch = -25.0; pitch <= 25.0; pitch += 12.5) {
      if (std::hypot(roll, pitch) > 28.0) continue;
      const Pose T_map_scan =
          pose_from_xyz_rpy({1, 2, 1.5}, {roll * kDegrees, pitch * kDegrees, 0.7});
      const Pose T_level_sensor = level_by_ground(yard(T_map_scan));
      // What is left of the tilt.
      CHECK_MESSAGE(tilt_of(T_map_scan * T_level_sensor.inverse()) < 2.0, roll, " ", pitch);
      CHECK(T_level_sensor.translation.norm() == 0.0);
    }
  }
}

TEST_CASE("a scan without ground stays as it is") {
  CHECK(tilt_of(level_by_ground({})) == 0.0);
  CHECK(tilt_of(level_by_ground(PointCloud{{1, 2, 3}})) < 34.0);
  PointCloud post;
  for (int i = 0; i < 200; ++i) post.emplace_back(3.0, 4.0, 0.05 * i);
  CHECK(tilt_of(level_by_ground(post)) < 34.0);
}
