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

/// The rule of the README in double, with library functions, each pixel against each point.
IndexList by_brute_force(PointsView map, const Point& viewpoint, const Given& given,
                         double max_range) {
  const double degree = kPi / 180.0, half = 0.5 * given.spacing;
  const int columns = static_cast<int>(std::round(360.0 / given.resolution));
  const double width = 2.0 * kPi / columns;
  const double height = (given.highest - given.lowest) * degree / given.rings;
  const auto row_of = [&](double elevation) {
    const double row = (elevation - given.lowest * degree) / height;
    return static_cast<int>(std::clamp(row, 0.0, given.rings - 1.0));
  };
  const auto column_of = [&](double azimuth) {
    return static_cast<int>((azimuth + kPi) / width) % columns;
  };
  const auto up = [&](double range) { return std::min(half / range, kPi); };
  const auto aside = [&](double level) {
    if (half >= level) return 2.0 * kPi;
    const double sine = half / level;
    return sine + (0.5 * kPi - 1.0) * sine * sine * sine;
  };
  const auto image = [&] {
    return std::vector(static_cast<std::size_t>(given.rings),
                       std::vector(static_cast<std::size_t>(columns), kInfinity));
  };
  const auto at = [&](auto& of, int row, int column) -> auto& {
    return of[static_cast<std::size_t>(row)]
             [static_cast<std::size_t>((column + columns) % columns)];
  };

  struct Pixel {
    double range;
    int row, column;
    std::uint32_t index;
  };
  std::vector<Pixel> all;
  auto nearest = image(), upright = image(), surface = image();
  for (std::uint32_t i = 0; i < map.size(); ++i) {
    const Point p = map[i] - viewpoint;
    const double range = p.norm(), level = p.head<2>().norm();
    const double elevation = std::atan2(p.z(), level), azimuth = std::atan2(p.y(), p.x());
    if (range <= 0.0 || range < given.min_range || range > max_range) continue;
    if (elevation < given.lowest * degree || elevation > given.highest * degree) continue;
    all.push_back({range, row_of(elevation), column_of(azimuth), i});
    for (int row = row_of(elevation - up(range)); row <= row_of(elevation + up(range)); ++row) {
      for (int column = 0; column < columns; ++column) {
        const double middle = (column + 0.5) * width - kPi;
        const double apart = std::abs(std::remainder(azimuth - middle, 2.0 * kPi));
        if (apart > aside(level) + 0.5 * width) continue;
        at(nearest, row, column) = std::min(at(nearest, row, column), range);
      }
    }
  }
  const auto raise = [](double& range, double other) {
    if (other < kInfinity) range = std::max(range, other);
  };
  for (int row = 0; row < given.rings; ++row) {
    for (int column = 0; column < columns; ++column) {
      const double range = at(nearest, row, column);
      at(upright, row, column) = range;
      if (range == kInfinity) continue;
      const int reach = 2 + static_cast<int>(up(range) / height);
      for (int other = std::max(row - reach, 0); other <= std::min(row + reach, given.rings - 1);
           ++other) {
        raise(at(upright, row, column), at(nearest, other, column));
      }
    }
  }
  for (int row = 0; row < given.rings; ++row) {
    const double cosine = std::cos(given.lowest * degree + (row + 0.5) * height);
    for (int column = 0; column < columns; ++column) {
      const double range = at(nearest, row, column);
      at(surface, row, column) = at(upright, row, column);
      if (range == kInfinity) continue;
      const int reach = std::min(2 + static_cast<int>(aside(range * cosine) / width), columns / 2);
      for (int other = column - reach; other <= column + reach; ++other) {
        raise(at(surface, row, column), at(upright, row, other));
      }
    }
  }
  IndexList indices;
  for (const Pixel& p : all) {
    const double from = at(surface, p.row, p.column);
    if (p.range <= from * (1.0 + given.relative) + given.tolerance) indices.push_back(p.index);
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

TEST_CASE("range_image: surfaces are seen whole, however flat the view on them is") {
  PointCloud street;  // the ground 1.73 m below the sensor, and a wall 4 m to its left
  for (double x = 5.0; x <= 40.0; x += 0.1) {
    for (double y = -2.0; y <= 2.0; y += 0.1) street.emplace_back(x, y, -1.73);
    for (double z = -1.0; z <= 1.0; z += 0.1) street.emplace_back(x, 4.0, z);
  }
  // At 40 m a ring's part of the ground is 7 m long and a column's part of the wall 1.4 m.
  const Given sensor{.rings = 64, .lowest = -24.9, .highest = 2.0, .resolution = 0.2};
  IndexList expected;  // but for the end of the street, with nothing behind it
  for (std::uint32_t i = 0; i < street.size(); ++i) {
    const Point& p = street[i];
    const double elevation = std::atan2(p.z(), p.head<2>().norm()) * 180.0 / kPi;
    const bool within = elevation >= sensor.lowest && elevation <= sensor.highest;
    if (within && p.x() < 35.0) expected.push_back(i);
  }
  CHECK(expected.size() > 15000);
  const IndexList indices = seen(street, Point::Zero(), sensor);
  CHECK(std::includes(indices.begin(), indices.end(), expected.begin(), expected.end()));
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
    const PointCloud row{{0.9, 0, 0}, {1.0, 0, 0}, {1.5, 0, 0}, {7.5, -3, 0}, {7.5, 3.5, 0}};
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

TEST_CASE("range_image: numbers at the ends of what is allowed" * doctest::test_suite("slow")) {
  const PointCloud map{{0, 0, 0},     {1e-320, 0, 0}, {1e-160, 0, 0}, {0, 1e-20, 0}, {3, 4, 0},
                       {0, 0, -1e10}, {1e14, 0, 0},   {-1e200, 0, 0}, {0, 1e308, 0}};
  for (const Given& given :
       {Given{.spacing = 0.0, .tolerance = 0.0}, Given{.rings = 1, .resolution = 90.0},
        Given{.rings = 2048, .lowest = 0.0, .highest = 0.1, .spacing = 10.0},
        Given{.spacing = 10.0, .tolerance = 1000.0, .relative = 10.0}}) {
    CAPTURE(given.toml());
    for (const Point& viewpoint : map) {
      for (const double max_range : {1e-320, 1e-25, 10.0, 1e300, kInfinity}) {
        for (const std::uint32_t i : seen(map, viewpoint, given, max_range)) {
          CHECK((map[i] - viewpoint).norm() > 0.0);
          CHECK((map[i] - viewpoint).norm() <= max_range);
        }
      }
    }
  }
  CHECK(seen(map, Point::Zero(), {.tolerance = 1000.0}) == IndexList{3, 4});
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
  CHECK(error_of("lowest_elevation = 5.0").find("0.1 deg above") != std::string::npos);
  CHECK(error_of("lowest_elevation = 1.95").find("0.1 deg above") != std::string::npos);
  CHECK(error_of("highest_elevation = 91.0").find("highest_elevation") != std::string::npos);
  for (const std::string key : {"point_spacing", "tolerance", "relative_tolerance"}) {
    for (const std::string value : {"-0.1", "1001.0", "1e30"}) {
      CAPTURE(key);
      CAPTURE(value);
      CHECK(error_of(key + " = " + value).find(key) != std::string::npos);
    }
  }

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
