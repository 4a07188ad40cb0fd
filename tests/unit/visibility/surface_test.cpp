#include <doctest/doctest.h>
#include <tbb/global_control.h>

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>
#include <random>
#include <string>
#include <utility>
#include <vector>

#include "support/plugins.hpp"
#include "vantage/visibility.hpp"

namespace vantage::test {
namespace {

constexpr double kSpacing = 0.12;  // [m]

/// Points on a rectangle, kSpacing apart, with noise across it.
PointCloud patch(const Point& corner, const Eigen::Vector3d& u, const Eigen::Vector3d& v,
                 double noise = 0.02) {
  std::mt19937 random(7);
  std::normal_distribution<double> across(0.0, std::max(noise, 1e-12));
  const Eigen::Vector3d normal = u.cross(v).normalized();
  PointCloud points;
  for (double a = 0.0; a < u.norm(); a += kSpacing) {
    for (double b = 0.0; b < v.norm(); b += kSpacing) {
      points.push_back(corner + a * u.normalized() + b * v.normalized() + across(random) * normal);
    }
  }
  return points;
}

/// A map in parts, and how much of each part is seen.
struct Scene {
  PointCloud points{};
  std::vector<std::size_t> ends{};
  void add(const PointCloud& part) {
    points.insert(points.end(), part.begin(), part.end());
    ends.push_back(points.size());
  }
  [[nodiscard]] std::vector<double> shares(
      const std::string& params, const Point& viewpoint,
      double max_range = std::numeric_limits<double>::infinity()) const {
    const auto surface = plugin<VisibilityOperator>("surface", params);
    const auto scene =
        surface->prepare(points, {.map_bounds = bounds_of(points), .max_range = max_range});
    REQUIRE(scene);
    const auto seen = (*scene)->visible(viewpoint);
    REQUIRE(seen);
    std::vector<double> all;
    std::size_t begin = 0;
    for (const std::size_t end : ends) {
      const auto inside = std::count_if(seen->begin(), seen->end(),
                                        [&](std::uint32_t k) { return k >= begin && k < end; });
      all.push_back(static_cast<double>(inside) / static_cast<double>(end - begin));
      begin = end;
    }
    return all;
  }
};

TEST_CASE("surface: a wall hides the wall behind it, and is seen with its whole thickness") {
  Scene scene;
  scene.add(patch({8, -6, -2}, {0, 12, 0}, {0, 0, 6}, 0.02));
  scene.add(patch({12, -3, -1}, {0, 6, 0}, {0, 0, 3}));
  const auto shares = scene.shares("", Point::Zero());
  CHECK(shares[0] == 1.0);
  CHECK(shares[1] == 0.0);
}

TEST_CASE("surface: no wall leaks, however it lies across the elements") {
  for (int degrees = 0; degrees < 360; degrees += 3) {
    CAPTURE(degrees);
    const Eigen::AngleAxisd turn(degrees * std::numbers::pi / 180.0, Eigen::Vector3d::UnitZ());
    Scene scene;
    const auto add = [&](double x, double half) {
      PointCloud wall;
      for (double y = -half; y < half + 0.05; y += 0.1) {
        for (double z = -half; z < half + 0.05; z += 0.1) wall.push_back(turn * Point(x, y, z));
      }
      scene.add(wall);
    };
    add(5.0, 3.0);
    add(6.0, 1.5);
    CHECK(scene.shares("", Point(0.03, -0.05, 0.02))[1] == 0.0);
  }
}

TEST_CASE("surface: what stands over ground that goes on beneath it hides little") {
  const auto behind = [](bool with_ground) {
    Scene scene;
    scene.add(patch({15, -4, -1.5}, {0, 8, 0}, {0, 0, 2.5}));  // a wall
    scene.add(patch({8, -6, -1.3}, {0, 12, 0}, {0, 0, 2.0}));  // the side of a vehicle, gone since
    if (with_ground) scene.add(patch({2, -8, -1.7}, {12, 0, 0}, {0, 16, 0}));
    return scene.shares("", Point::Zero())[0];
  };
  CHECK(behind(true) > 0.95);
  CHECK(behind(false) < 0.5);
}

TEST_CASE("surface: what stands on the ground, no higher than a vehicle, hides little") {
  const auto behind = [](double height) {
    Scene scene;
    scene.add(patch({15, -4, -1.5}, {0, 8, 0}, {0, 0, 2.0}));     // a wall
    scene.add(patch({8, -6, -1.6}, {0, 12, 0}, {0, 0, height}));  // before it, on unknown ground
    scene.add(patch({2, -8, -1.7}, {5.6, 0, 0}, {0, 16, 0}));
    scene.add(patch({8.4, -8, -1.7}, {6, 0, 0}, {0, 16, 0}));
    return scene.shares("", Point::Zero())[0];
  };
  CHECK(behind(2.0) > 0.95);
  CHECK(behind(5.0) < 0.05);
}

TEST_CASE("surface: the ground ahead does not hide the ground behind it") {
  Scene scene;
  scene.add(patch({3, -3, -1.7}, {27, 0, 0}, {0, 6, 0}));
  CHECK(scene.shares("faintest = -30.0", Point::Zero())[0] > 0.95);
}

TEST_CASE("surface: lower thresholds see more, and never less") {
  std::mt19937 random(3);
  std::uniform_real_distribution<double> place(-15.0, 15.0);
  PointCloud map(20'000);
  for (Point& p : map) p = {place(random), place(random), 0.2 * place(random)};
  IndexList before;
  for (const char* params : {"faintest = 0.0", "faintest = -10.0", "faintest = -30.0"}) {
    const auto surface = plugin<VisibilityOperator>("surface", params);
    const auto scene = surface->prepare(map, {.map_bounds = bounds_of(map)});
    REQUIRE(scene);
    const auto seen = (*scene)->visible(Point::Zero());
    REQUIRE(seen);
    CHECK(seen->size() > before.size());
    CHECK(std::includes(seen->begin(), seen->end(), before.begin(), before.end()));
    before = *seen;
  }
}

TEST_CASE("surface: sees nothing beyond where the largest surface is too faint") {
  PointCloud map;
  for (int i = 0; i < 300; ++i) {
    for (int j = 0; j < 300; ++j) map.emplace_back(0.05 * i - 7.5, 0.05 * j - 7.5, -1.5);
  }
  std::mt19937 random(2);
  std::uniform_real_distribution<double> place(-6.0, 6.0);
  PointCloud viewpoints(40);
  for (Point& p : viewpoints) p = {place(random), place(random), 0.0};
  // At some of these, what can be seen ends within a block, before its elements.
  const std::size_t all = viewpoints.size() * map.size();
  std::size_t before = all;
  for (double faintest = -12.0; faintest <= 12.0; faintest += 1.0) {
    CAPTURE(faintest);
    const auto surface =
        plugin<VisibilityOperator>("surface", "faintest = " + std::to_string(faintest));
    const auto scene = surface->prepare(map, {.map_bounds = bounds_of(map)});
    REQUIRE(scene);
    std::size_t now = 0;
    for (const Point& viewpoint : viewpoints) {
      const auto seen = (*scene)->visible(viewpoint);
      REQUIRE(seen);
      now += seen->size();
    }
    CHECK(now <= before);
    before = now;
  }
  CHECK(before < all / 2);
}

TEST_CASE("surface: one thread or two see the same") {
  std::mt19937 random(5);
  std::uniform_real_distribution<double> place(-15.0, 15.0);
  PointCloud map(30'000), viewpoints(40);
  for (Point& p : map) p = {place(random), place(random), 0.2 * place(random)};
  for (Point& p : viewpoints) p = {place(random), place(random), 0.1 * place(random)};
  const auto surface = plugin<VisibilityOperator>("surface");
  const auto seen_by = [&](std::size_t threads) {
    const tbb::global_control limit(tbb::global_control::max_allowed_parallelism, threads);
    const auto scene = surface->prepare(map, {.map_bounds = bounds_of(map), .max_range = 9.0});
    REQUIRE(scene);
    const auto seen = (*scene)->visible_from_any(viewpoints);
    REQUIRE(seen);
    return *seen;
  };
  const IndexList one = seen_by(1);
  CHECK(one.size() > 1000);
  CHECK(seen_by(2) == one);
}

TEST_CASE("surface: a viewpoint however far away sees what it can, or nothing") {
  Scene scene;
  scene.add(patch({8, -6, -2}, {0, 12, 0}, {0, 0, 6}));
  for (const double distance : {1e4, 1e8, 1e12, 1e150, 1e300}) {
    const double seen = scene.shares("faintest = -200.0", Point(-distance, 0, 0))[0];
    CHECK(seen == (distance < 1e9 ? 1.0 : 0.0));
  }
}

TEST_CASE("surface: a map that is too wide for its elements is an error that names the width") {
  const PointCloud map{{0, 0, 0}, {1e6, 0, 0}};
  const auto surface = plugin<VisibilityOperator>("surface");
  const auto scene = surface->prepare(map, {.map_bounds = bounds_of(map)});
  REQUIRE_FALSE(scene);
  CHECK(scene.error().code == ErrorCode::invalid_input);
  CHECK(scene.error().message.find("point_spacing") != std::string::npos);
}

}  // namespace
}  // namespace vantage::test
