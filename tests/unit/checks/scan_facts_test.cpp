#include "checks/scan_facts.hpp"

#include <doctest/doctest.h>

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <numbers>

#include "checks/sensor_place.hpp"

namespace vantage::checks {
namespace {

constexpr double kDegree = std::numbers::pi / 180.0;

/// Ground 1.7 m below the sensor, and a wall 12 m ahead.
PointCloud scene() {
  PointCloud points;
  for (double x = -25.0; x < 25.0; x += 0.5) {
    for (double y = -25.0; y < 25.0; y += 0.5) points.emplace_back(x + 0.1, y + 0.1, -1.7);
  }
  for (double y = -8.0; y < 8.0; y += 0.25) {
    for (double z = -1.7; z < 4.0; z += 0.25) points.emplace_back(12.0, y, z);
  }
  return points;
}

io::StampedScan scan_of(PointCloud points) {
  io::StampedScan scan;
  scan.points = std::move(points);
  return scan;
}

ScanFacts facts_of(const PointCloud& points) {
  ScanSurvey survey;
  for (int k = 0; k < 3; ++k) survey.add(scan_of(points));
  return survey.facts();
}

TEST_CASE("the ground below a tilted sensor") {
  PointCloud points = scene();
  const Eigen::Matrix3d tilt =
      Eigen::AngleAxisd(8.0 * kDegree, Eigen::Vector3d::UnitX()).toRotationMatrix();
  for (Point& p : points) p = tilt * p;
  const auto ground = find_ground(points, false);
  REQUIRE(ground);
  CHECK(ground->distance == doctest::Approx(1.7).epsilon(0.05));
  CHECK(ground->tilt == doctest::Approx(8.0 * kDegree).epsilon(0.1));
  CHECK(ground->share > 0.9);
}

TEST_CASE("the ground above a sensor that hangs upside down") {
  PointCloud points = scene();
  for (Point& p : points) p.z() = -p.z();
  const ScanFacts facts = facts_of(points);
  REQUIRE(facts.above);
  CHECK(facts.above->distance == doctest::Approx(1.7).epsilon(0.05));
  CHECK(facts.above->share > 0.9);
  CHECK((!facts.below || facts.below->share < 0.2));
}

TEST_CASE("scans without their ground show none") {
  PointCloud slope, few;  // of what stands on the ground, from 0.3 m above the sensor on
  for (double x = -20.0; x < 20.0; x += 0.5) {
    for (double y = -20.0; y < 20.0; y += 0.5) slope.emplace_back(x, y, 4.0 + 0.15 * x);
  }
  CHECK_FALSE(find_ground(slope, false));
  for (double x = 5.0; x < 12.0; x += 1.0) {
    for (double y = -3.0; y < 3.0; y += 1.0) few.emplace_back(x, y, -1.7);
  }
  CHECK_FALSE(find_ground(few, false));
}

TEST_CASE("ranges") {
  PointCloud points;
  for (int k = 1; k <= 100; ++k) points.emplace_back(k, 0.0, 0.0);
  const ScanFacts facts = facts_of(points);
  CHECK(facts.range_at(0.5) == doctest::Approx(50.0).epsilon(0.03));
  CHECK(facts.share_within(10.5, 20.5) == doctest::Approx(0.1));
  CHECK(facts.share_within(200.0, 300.0) == 0.0);
}

TEST_CASE("elevations, but not those of the robot itself") {
  PointCloud points(50, Point(0.0, 0.1, 0.9));
  for (int k = 0; k < 100; ++k) points.emplace_back(0.0, -10.0, 0.1 * k);
  const ScanFacts facts = facts_of(points);
  CHECK(facts.elevation_at(0.0) == 0.0);
  CHECK(facts.elevation_at(0.5) == doctest::Approx(std::atan(0.5)).epsilon(0.03));
  CHECK(facts.elevation_at(1.0) == doctest::Approx(std::atan(0.99)));
  CHECK(ScanFacts{}.elevation_at(0.5) == 0.0);
}

TEST_CASE("scans in the map's frame lie far beside the sensor") {
  CHECK(facts_of(scene()).eccentricity < 1.0);
  PointCloud points = scene();
  for (Point& p : points) p += Point(300.0, 200.0, 0.0);
  CHECK(facts_of(points).eccentricity > 10.0);
}

/// What a sensor at `sensor` sees of a ground with columns on it, in the frame of the ground.
PointCloud seen_from(const Point& sensor) {
  constexpr double kRadius = 1.0, kHeight = 9.0, kReach = 60.0;  // [m]
  PointCloud points;
  for (int turn = 0; turn < 360; ++turn) {
    for (int rise = -15; rise <= 15; ++rise) {
      const double a = (turn + 0.3) * kDegree, e = (rise + 0.5) * kDegree;
      const Eigen::Vector3d ray(std::cos(e) * std::cos(a), std::cos(e) * std::sin(a), std::sin(e));
      double range = ray.z() < 0.0 ? -sensor.z() / ray.z() : 2.0 * kReach;
      for (int i = -8; i <= 12; ++i) {
        for (int j = -9; j <= 9; ++j) {
          const Eigen::Vector2d middle(7.0 * i + 3.0 * (j % 2) + 3.5, 7.0 * j + 3.5);
          const Eigen::Vector2d to = middle - sensor.head<2>(), flat = ray.head<2>().normalized();
          const double along = to.dot(flat), aside = (to - along * flat).norm();
          if (along <= 0.0 || aside >= kRadius) continue;
          const double hit = (along - std::sqrt(kRadius * kRadius - aside * aside)) / std::cos(e);
          if (sensor.z() + hit * ray.z() < kHeight) range = std::min(range, hit);
        }
      }
      if (range < kReach) points.push_back(sensor + range * ray);
    }
  }
  return points;
}

TEST_CASE("scans in the frame of the map show where their sensor was") {
  ScanSurvey in_map, in_sensor;
  for (const double x : {0.0, 5.0, 20.0, 30.0}) {
    CAPTURE(x);
    const Point sensor(x, 0.2 * x, 1.8);
    PointCloud points = seen_from(sensor);
    for (Point& p : points) p.z() -= 1.8;  // the map's origin is where the drive begins
    const SensorPlace found = find_sensor(points);
    CHECK(found.is_elsewhere() == (x > 0.0));
    if (found.is_elsewhere()) CHECK((found.at - sensor.head<2>()).norm() < 1.0);
    in_map.place(scan_of(points));
    for (Point& p : points) p -= Point(x, 0.2 * x, 0.0);
    const SensorPlace own = find_sensor(points);
    CHECK_FALSE(own.is_elsewhere());
    CHECK(own.hidden_at_origin < 0.15);
    in_sensor.add(scan_of(points));
  }
  CHECK(in_map.facts().placed == 4);
  CHECK(in_map.facts().elsewhere == 3);
  CHECK(in_map.facts().farthest == doctest::Approx(30.6).epsilon(0.05));
  CHECK(in_sensor.facts().elsewhere == 0);
}

TEST_CASE("times, empty scans, points that are no returns") {
  ScanSurvey survey;
  io::StampedScan scan = scan_of(scene());
  scan.seconds.assign(scan.points.size(), 0.0F);
  scan.seconds.back() = 0.1F;
  scan.no_returns = scan.points.size();
  survey.add(scan);
  CHECK(survey.facts().timed);
  CHECK(survey.facts().sweep == doctest::Approx(0.1));
  CHECK(survey.facts().dropped_share == doctest::Approx(0.5));
  survey.add(io::StampedScan{});
  CHECK(survey.facts().empty == 1);
  CHECK(survey.facts().timed);
  survey.add(scan_of(scene()));
  CHECK_FALSE(survey.facts().timed);
  CHECK(ScanSurvey().facts().scans == 0);
}

}  // namespace
}  // namespace vantage::checks
