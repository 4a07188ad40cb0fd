// range_image against its stated rule, by brute force, and what it is for.
#include <doctest/doctest.h>

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <future>
#include <limits>
#include <numbers>
#include <string>
#include <vector>

#include "scenes.hpp"
#include "support/plugins.hpp"
#include "support/reports.hpp"

namespace vantage::test {
namespace {

constexpr double kInfinity = std::numeric_limits<double>::infinity();
constexpr double kPi = std::numbers::pi;

struct Given {
  int rings = 90;
  double lowest = -90.0, highest = 90.0, resolution = 2.0;  // [deg]
  double min_range = 0.0, spacing = 0.1, tolerance = 0.2, relative = 0.0;

  [[nodiscard]] std::string toml() const {
    return "rings = " + std::to_string(rings) + "\nlowest_elevation = " + std::to_string(lowest) +
           "\nhighest_elevation = " + std::to_string(highest) +
           "\nazimuth_resolution = " + std::to_string(resolution) +
           "\nmin_range = " + std::to_string(min_range) +
           "\npoint_spacing = " + std::to_string(spacing) +
           "\ntolerance = " + std::to_string(tolerance) +
           "\nrelative_tolerance = " + std::to_string(relative);
  }
};

IndexList seen(PointsView map, const Point& viewpoint, const Given& given,
               double max_range = kInfinity) {
  const auto visibility = plugin<VisibilityOperator>("range_image", given.toml());
  const auto scene =
      visibility->prepare(map, {.map_bounds = bounds_of(map), .max_range = max_range});
  REQUIRE(scene);
  const auto indices = (*scene)->visible(viewpoint);
  REQUIRE(indices);
  return *indices;
}

/// How many of `indices` are in [first, last).
std::size_t among(const IndexList& indices, std::size_t first, std::size_t last) {
  return static_cast<std::size_t>(std::count_if(
      indices.begin(), indices.end(), [&](std::uint32_t i) { return i >= first && i < last; }));
}

/// The rule of the README in double, with library functions, each point against each other.
IndexList by_brute_force(PointsView map, const Point& viewpoint, const Given& given,
                         double max_range) {
  struct Seen {
    double range, elevation, azimuth, level;
    std::uint32_t index;
  };
  const double degree = kPi / 180.0;
  std::vector<Seen> all;
  for (std::uint32_t i = 0; i < map.size(); ++i) {
    const Point p = map[i] - viewpoint;
    const double range = p.norm(), level = p.head<2>().norm();
    const double elevation = std::atan2(p.z(), level);
    if (range <= 0.0 || range < given.min_range || range > max_range) continue;
    if (elevation < given.lowest * degree || elevation > given.highest * degree) continue;
    all.push_back({range, elevation, std::atan2(p.y(), p.x()), level, i});
  }
  const double columns = std::round(360.0 / given.resolution);
  const double width = 2.0 * kPi / columns;
  const double height = (given.highest - given.lowest) * degree / given.rings;
  const auto row_of = [&](double elevation) {
    return std::clamp(std::floor((elevation - given.lowest * degree) / height), 0.0,
                      given.rings - 1.0);
  };
  IndexList indices;
  for (const Seen& p : all) {
    const double row = row_of(p.elevation);
    const double middle = (std::floor((p.azimuth + kPi) / width) + 0.5) * width - kPi;
    double nearest = kInfinity;
    for (const Seen& other : all) {
      const double half = 0.5 * given.spacing;
      const double up = std::min(half / other.range, kPi);
      if (row < row_of(other.elevation - up) || row > row_of(other.elevation + up)) continue;
      if (half < other.level) {
        const double sine = half / other.level;
        const double aside = sine + (0.5 * kPi - 1.0) * sine * sine * sine;
        const double apart = std::abs(std::remainder(other.azimuth - middle, 2.0 * kPi));
        if (apart > aside + 0.5 * width) continue;
      }
      nearest = std::min(nearest, other.range);
    }
    if (p.range <= nearest * (1.0 + given.relative) + given.tolerance) indices.push_back(p.index);
  }
  return indices;
}

TEST_CASE("range_image sees what brute force sees") {
  const PointCloud cloud = ball(1, 1500, 20.0, 0.0, {100, -200, 30});
  const Point viewpoint(101, -199, 30.5);
  const auto check = [&](const Given& given, double max_range) {
    CAPTURE(given.toml());
    const IndexList expected = by_brute_force(cloud, viewpoint, given, max_range);
    CHECK(!expected.empty());
    CHECK(expected.size() < cloud.size());
    CHECK(seen(cloud, viewpoint, given, max_range) == expected);
  };
  check({}, kInfinity);
  check({.spacing = 1.0}, kInfinity);
  check({.spacing = 3.0}, 12.0);
  check({.spacing = 0.0}, kInfinity);
  check({.rings = 16, .lowest = -15.0, .highest = 15.0, .resolution = 0.2, .spacing = 0.5}, 15.0);
  check({.rings = 7, .lowest = 20.0, .highest = 90.0, .resolution = 7.3}, kInfinity);
  check({.rings = 1, .lowest = -90.0, .highest = -60.0, .resolution = 90.0}, kInfinity);
  check({.min_range = 6.0, .spacing = 2.0, .tolerance = 0.0}, kInfinity);
  check({.spacing = 1.0, .tolerance = 0.0, .relative = 0.1}, kInfinity);
}

TEST_CASE("range_image: a wall hides a wall behind it, as near and thin as it may be") {
  // 10 cm apart at 2 m are 2.9 degrees: many pixels lie between the points.
  const Given fine{.rings = 900, .resolution = 0.2};
  for (const double distance : {2.0, 5.0, 10.0}) {
    CAPTURE(distance);
    const PointCloud front = wall(distance, static_cast<int>(10 * distance), 0.1);
    const PointCloud both = joined(front, wall(distance + 1.0, 8, 0.1));
    const IndexList indices = seen(both, {0.02, 0.01, -0.03}, fine);
    CHECK(among(indices, front.size(), both.size()) == 0);
    CHECK(among(indices, 0, front.size()) > front.size() * 9 / 10);
    // With points of no size it is seen through the gaps.
    const Given points{.rings = 900, .resolution = 0.2, .spacing = 0.0};
    CHECK(among(seen(both, {0.02, 0.01, -0.03}, points), front.size(), both.size()) > 0);
  }
}

TEST_CASE("range_image: the tolerances are how far behind a point is seen") {
  const auto is_seen = [](double behind, const Given& given) {
    const PointCloud map{{10, 0.01, 0.01}, {10 + behind, 0.01, 0.01}};
    const IndexList indices = seen(map, Point::Zero(), given);
    REQUIRE(!indices.empty());
    CHECK(indices.front() == 0);
    return indices.size() == 2;
  };
  CHECK(is_seen(0.29, {.tolerance = 0.3}));
  CHECK(!is_seen(0.31, {.tolerance = 0.3}));
  CHECK(is_seen(0.49, {.tolerance = 0.3, .relative = 0.02}));
  CHECK(!is_seen(0.51, {.tolerance = 0.3, .relative = 0.02}));
  CHECK(is_seen(0.0, {.tolerance = 0.0}));
  CHECK(!is_seen(0.01, {.tolerance = 0.0}));
}

TEST_CASE("range_image: what the sensor cannot see hides nothing") {
  SUBCASE("below and above its field of view") {
    const Given sensor{.rings = 32, .lowest = -20.0, .highest = 10.0, .spacing = 2.0};
    const auto at = [](double elevation, double range) {
      const double angle = elevation * kPi / 180.0;
      return Point(range * std::cos(angle), 0.0, range * std::sin(angle));
    };
    // The near points are large: inside the field of view they would cover all the others.
    CHECK(seen(PointCloud{at(-20.1, 2), at(10.1, 2), at(-19.9, 9), at(9.9, 9)}, Point::Zero(),
               sensor) == IndexList{2, 3});
    CHECK(seen(PointCloud{at(-19.9, 2), at(-19.8, 9), at(-90, 5), at(90, 5)}, Point::Zero(),
               sensor) == IndexList{0});
  }
  SUBCASE("nearer than its range begins, and farther than it ends") {
    const PointCloud row{{0.9, 0, 0}, {1.0, 0, 0}, {1.5, 0, 0}, {8.0, 1, 0}, {8.0, -4, 0}};
    const Given sensor{.min_range = 1.0};
    CHECK(seen(row, Point::Zero(), sensor, 8.1) == IndexList{1, 3});
    CHECK(seen(row, Point::Zero(), {.min_range = 1.2}, 8.1) == IndexList{2, 3});
    CHECK(seen(row, Point::Zero(), {.min_range = 0.0}, 8.1) == IndexList{0, 1, 3});
  }
  SUBCASE("both ends of the field of view and of the ranges are seen") {
    const PointCloud axes{{2, 0, 0}, {-2, 0, 0}, {0, 2, 0}, {0, -2, 0}, {0, 0, 2}, {0, 0, -2}};
    CHECK(seen(axes, Point::Zero(), {.min_range = 2.0}, 2.0) == IndexList{0, 1, 2, 3, 4, 5});
  }
}

TEST_CASE("range_image: a point covers what is behind it across the turn and over the pole") {
  const Given sensor{.spacing = 0.5};
  // At azimuths of 179.9 and -179.9 degrees, and at opposite azimuths 1 degree from straight up.
  CHECK(seen(PointCloud{{-5, 0.01, 0.1}, {-9, -0.01, 0.2}}, Point::Zero(), sensor) == IndexList{0});
  CHECK(seen(PointCloud{{0.05, 0, 5}, {-0.1, 0, 9}}, Point::Zero(), sensor) == IndexList{0});
}

TEST_CASE("range_image: several viewpoints see what one of them sees, in any number of calls") {
  const PointCloud map = ball(2, 20000, 30.0);
  const PointCloud viewpoints = ball(3, 25, 20.0);
  const Given sensor{.rings = 40, .lowest = -30.0, .highest = 30.0, .spacing = 0.3};
  const auto visibility = plugin<VisibilityOperator>("range_image", sensor.toml());
  const auto scene = visibility->prepare(map, {.map_bounds = bounds_of(map), .max_range = 12.0});
  REQUIRE(scene);
  std::vector<bool> is_seen(map.size());
  for (const Point& viewpoint : viewpoints) {
    for (const std::uint32_t i : seen(map, viewpoint, sensor, 12.0)) is_seen[i] = true;
  }
  IndexList expected;
  for (std::uint32_t i = 0; i < map.size(); ++i) {
    if (is_seen[i]) expected.push_back(i);
  }
  CHECK(expected.size() > 1000);
  CHECK(expected.size() < map.size());
  const Reports reports;
  CHECK((*scene)->visible_from_any(viewpoints, &reports) == expected);
  CHECK(reports.viewpoints() == viewpoints.size());
  const auto ask = [&] { return (*scene)->visible_from_any(viewpoints); };
  auto other = std::async(std::launch::async, ask);
  CHECK(ask() == expected);
  CHECK(other.get() == expected);
}

TEST_CASE("range_image refuses what is no sensor and no map") {
  const auto error_of = [](const std::string& params) -> std::string {
    try {
      (void)plugin<VisibilityOperator>("range_image", params);
    } catch (const std::runtime_error& e) {
      return e.what();
    }
    return {};
  };
  CHECK(error_of("").empty());
  CHECK(error_of("rings = 0").find("rings") != std::string::npos);
  CHECK(error_of("azimuth_resolution = 0.0").find("azimuth_resolution") != std::string::npos);
  CHECK(error_of("lowest_elevation = 5.0").find("must be above") != std::string::npos);
  CHECK(error_of("highest_elevation = 91.0").find("highest_elevation") != std::string::npos);
  CHECK(error_of("point_spacing = -0.1").find("point_spacing") != std::string::npos);

  const auto visibility = plugin<VisibilityOperator>("range_image");
  const PointCloud map = ball(4, 100, 5.0);
  const auto refusal = [&](PointsView points, const VisibilityLimits& limits) {
    const auto scene = visibility->prepare(points, limits);
    REQUIRE(!scene);
    CHECK(scene.error().code == ErrorCode::invalid_input);
    return scene.error().message;
  };
  const Bounds3 bounds = bounds_of(map);
  CHECK(!refusal({}, {.map_bounds = bounds}).empty());
  CHECK(refusal(map, {.map_bounds = bounds, .max_range = 0.0}).find("max_range") !=
        std::string::npos);
  CHECK(refusal(map, {.map_bounds = bounds, .max_range = 0.4}).find("min_range") !=
        std::string::npos);
  CHECK(
      refusal(map, {.map_bounds = {.min = bounds.min, .max = Point::Zero()}}).find("map_bounds") !=
      std::string::npos);
}

}  // namespace
}  // namespace vantage::test
