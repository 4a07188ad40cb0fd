#include "view/posed_scan.hpp"

#include <doctest/doctest.h>

#include <cmath>
#include <limits>

using namespace vantage;
using namespace vantage::view;

namespace {

/// Drives a bend at 10 m/s.
Pose pose_of_drive(double stamp) {
  const double turn = 0.8 * stamp;
  Pose pose = pose_from_xyz_rpy({0, 0, 1.5}, {0, 0, turn});
  pose.translation.head<2>() = 10.0 / 0.8 * Eigen::Vector2d(std::sin(turn), 1.0 - std::cos(turn));
  return pose;
}

io::Trajectory drive() {
  io::Trajectory drive;
  for (int i = 0; i <= 100; ++i) drive.push_back({0.01 * i, pose_of_drive(0.01 * i)});
  return drive;
}

/// Posts all around, farther apart than the voxels of thinning.
PointCloud posts() {
  PointCloud posts;
  for (int i = 0; i < 60; ++i) {
    posts.emplace_back(20.0 * std::cos(0.1 * i), 20.0 * std::sin(0.1 * i), 0.3 * (i % 7));
  }
  return posts;
}

/// A sweep of 0.1 s over the posts.
io::StampedScan sweep_at(double stamp) {
  io::StampedScan scan;
  scan.stamp = stamp;
  const PointCloud all = posts();
  for (std::size_t i = 0; i < all.size(); ++i) {
    scan.seconds.push_back(0.1F * static_cast<float>(i) / static_cast<float>(all.size() - 1));
    scan.points.push_back(
        pose_of_drive(stamp + static_cast<double>(scan.seconds.back())).inverse() * all[i]);
  }
  return scan;
}

/// How far a point lies from the nearest post, at most [m].
double farthest_from_posts(const PosedScan& scan) {
  double farthest = 0.0;
  for (const Point& p : scan.points) {
    double nearest = std::numeric_limits<double>::infinity();
    for (const Point& post : posts()) {
      nearest = std::min(nearest, (scan.T_map_scan * p - post).norm());
    }
    farthest = std::max(farthest, nearest);
  }
  return farthest;
}

}  // namespace

TEST_CASE("a sweep is undistorted by the motion of the reference, to its middle") {
  const auto scan = posed_scan(sweep_at(0.4), drive());
  REQUIRE(scan);
  REQUIRE(*scan);
  CHECK((*scan)->points.size() == posts().size());
  CHECK(((*scan)->T_map_scan.translation - pose_of_drive(0.45).translation).norm() < 1e-4);
  CHECK(farthest_from_posts(**scan) < 0.002);
}

TEST_CASE("a sweep whose end has no pose stays as it was measured") {
  const auto scan = posed_scan(sweep_at(0.93), drive());
  REQUIRE(scan);
  REQUIRE(*scan);
  CHECK(farthest_from_posts(**scan) > 0.3);
}

TEST_CASE(
    "a scan without times is taken at the pose of its stamp, and is left out if there is no pose") {
  io::StampedScan scan = sweep_at(0.4);
  scan.seconds.clear();
  const auto untimed = posed_scan(scan, drive());
  REQUIRE(untimed);
  REQUIRE(*untimed);
  CHECK(((*untimed)->T_map_scan.translation - pose_of_drive(0.4).translation).norm() < 1e-9);
  scan.stamp = 7.0;
  CHECK_FALSE(posed_scan(scan, drive()).value());
}
