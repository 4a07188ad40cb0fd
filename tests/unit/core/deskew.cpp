#include "vantage/engine/deskew.hpp"

#include <doctest/doctest.h>

#include <Eigen/Geometry>
#include <cmath>
#include <cstddef>
#include <limits>
#include <numbers>
#include <string>
#include <vector>

namespace vantage {
namespace {

constexpr double kQuarterTurn = std::numbers::pi / 2.0;
constexpr float kNan = std::numeric_limits<float>::quiet_NaN();
constexpr float kInfinity = std::numeric_limits<float>::infinity();

PointCloud deskewed(const PointCloud& points, const std::vector<float>& seconds,
                    const Pose& T_now_later, double interval) {
  auto result = deskew(points, seconds, T_now_later, interval);
  REQUIRE_MESSAGE(result, to_string(result.error()));
  REQUIRE(result->size() == points.size());
  return *std::move(result);
}

double distance(const Point& a, const Point& b) { return (a - b).norm(); }

TEST_CASE("deskew puts each point where the sensor at the stamp would see it") {
  SUBCASE("a sensor that drives on") {  // 2 m in half a second
    const Pose step{.rotation = Pose{}.rotation, .translation = {2.0, 0.0, -1.0}};
    const PointCloud points(4, Point(10.0, 5.0, 1.0));
    const PointCloud result = deskewed(points, {0.0F, 0.25F, -0.125F, 1.0F}, step, 0.5);
    CHECK(result[0] == points[0]);
    CHECK(result[1] == Point(11.0, 5.0, 0.5));
    CHECK(result[2] == Point(9.5, 5.0, 1.25));   // before the stamp
    CHECK(result[3] == Point(14.0, 5.0, -1.0));  // beyond the interval
  }
  SUBCASE("a sensor that turns left on the spot") {  // a right angle a second
    const Pose step = pose_from_xyz_rpy({0, 0, 0}, {0, 0, kQuarterTurn});
    const PointCloud points(4, Point(10.0, 0.0, 1.0));
    const PointCloud result = deskewed(points, {0.0F, 1.0F, 2.0F, -1.0F}, step, 1.0);
    CHECK(result[0] == points[0]);
    CHECK(distance(result[1], {0.0, 10.0, 1.0}) < 1e-12);
    CHECK(distance(result[2], {-10.0, 0.0, 1.0}) < 1e-12);
    CHECK(distance(result[3], {0.0, -10.0, 1.0}) < 1e-12);
  }
  SUBCASE("a sensor that drives and turns") {
    const Pose step = pose_from_xyz_rpy({4.0, 2.0, 0.0}, {0, 0, kQuarterTurn});
    const PointCloud points{{10.0, 0.0, 1.0}, {1.0, 1.0, 0.0}};
    const PointCloud result = deskewed(points, {2.0F, 1.0F}, step, 2.0);
    CHECK(distance(result[0], {4.0, 12.0, 1.0}) < 1e-12);
    // Half the way: the middle of the line, turned by 45 degrees.
    CHECK(distance(result[1], {2.0, 1.0 + std::numbers::sqrt2, 0.0}) < 1e-12);
  }
  SUBCASE("any motion: as interpolate says") {
    const Pose step = pose_from_xyz_rpy({0.3, -0.1, 0.02}, {0.02, -0.03, 0.3});
    PointCloud points;
    std::vector<float> seconds;
    for (int i = 0; i < 500; ++i) {
      points.emplace_back(30.0 * std::sin(i), 30.0 * std::cos(1.7 * i), std::sin(0.3 * i));
      seconds.push_back(static_cast<float>((i / 4) % 50) * 0.002F - 0.02F);
    }
    const PointCloud result = deskewed(points, seconds, step, 0.1);
    for (std::size_t i = 0; i < points.size(); ++i) {
      const double fraction = static_cast<double>(seconds[i]) / 0.1;
      CHECK(distance(result[i], interpolate(Pose{}, step, fraction) * points[i]) < 1e-12);
    }
    SUBCASE("whatever points are beside it") {
      const PointCloud backwards =
          deskewed({points.rbegin(), points.rend()}, {seconds.rbegin(), seconds.rend()}, step, 0.1);
      CHECK((PointCloud(backwards.rbegin(), backwards.rend()) == result));
    }
  }
  SUBCASE("the way back takes the way there back") {
    const Pose step = pose_from_xyz_rpy({0.0, 0.0, 0.0}, {0.1, 0.2, -0.5});
    const PointCloud points{{7.0, -3.0, 2.0}};
    const PointCloud there = deskewed(points, {0.05F}, step, 0.1);
    CHECK(distance(deskewed(there, {0.05F}, step.inverse(), 0.1)[0], points[0]) < 1e-12);
  }
}

TEST_CASE("deskew without motion changes nothing") {
  const PointCloud points{{0.1, 0.2, 0.3}, {1e6 + 0.1, -7.7, 1e-3}};
  CHECK(deskewed(points, {0.0F, 0.1F}, Pose{}, 0.1) == points);
  const Pose step = pose_from_xyz_rpy({1, 2, 3}, {0.1, 0.2, 0.3});
  CHECK(deskewed(points, {0.0F, 0.0F}, step, 0.1) == points);
  CHECK(deskewed({}, {}, step, 0.1).empty());
}

TEST_CASE("deskew leaves points that are not finite not finite") {
  const double nan = std::numeric_limits<double>::quiet_NaN();
  const double infinity = std::numeric_limits<double>::infinity();
  const PointCloud points{{nan, nan, nan}, {1, infinity, 2}, {1, 2, 3}, {-infinity, 0, 0}};
  const Pose step = pose_from_xyz_rpy({1, 2, 3}, {0.1, 0.2, 0.3});
  const PointCloud result = deskewed(points, {0.01F, 0.02F, 0.03F, 0.0F}, step, 0.1);
  for (std::size_t i = 0; i < points.size(); ++i) {
    CHECK(result[i].allFinite() == points[i].allFinite());
  }
}

TEST_CASE("deskew refuses what makes no sense") {
  const PointCloud points{{1, 2, 3}, {4, 5, 6}};
  const Pose step = pose_from_xyz_rpy({1, 0, 0}, {0, 0, 0.1});
  const auto refused = [&](const std::vector<float>& seconds, const Pose& motion, double interval,
                           const std::string& expected) {
    const auto result = deskew(points, seconds, motion, interval);
    REQUIRE_FALSE(result);
    CHECK(result.error().code == ErrorCode::invalid_input);
    CAPTURE(result.error().message);
    CHECK(result.error().message.find(expected) != std::string::npos);
  };
  refused({}, step, 0.1, "2 points and 0 times");
  refused({0.0F}, step, 0.1, "2 points and 1 times");
  refused({0.0F, 0.1F, 0.2F}, step, 0.1, "2 points and 3 times");
  refused({0.0F, kNan}, step, 0.1, "point 1 of the scan");
  refused({-kInfinity, 0.0F}, step, 0.1, "point 0 of the scan");
  refused({0.0F, 1e30F}, step, 1e-300, "point 1 of the scan");
  for (const double interval :
       {0.0, -0.1, static_cast<double>(kNan), static_cast<double>(kInfinity)}) {
    refused({0.0F, 0.1F}, step, interval, "expected a positive number");
  }
  Pose wrong = step;
  wrong.rotation.coeffs() *= 1.5;
  refused({0.0F, 0.1F}, wrong, 0.1, "no rigid transform");
  wrong = step;
  wrong.translation.x() = static_cast<double>(kNan);
  refused({0.0F, 0.1F}, wrong, 0.1, "no rigid transform");
}

}  // namespace
}  // namespace vantage
