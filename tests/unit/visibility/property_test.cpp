// What must hold for every map; through the loaded plugin.
#include <doctest/doctest.h>

#include <algorithm>
#include <numeric>
#include <random>
#include <thread>

#include "scenes.hpp"
#include "support/plugins.hpp"

namespace vantage::test {
namespace {

bool contains(const IndexList& list, std::uint32_t i) {
  return std::binary_search(list.begin(), list.end(), i);
}

bool is_strictly_ascending(const IndexList& list) {
  return std::adjacent_find(list.begin(), list.end(), std::greater_equal<>{}) == list.end();
}

TEST_CASE("hpr returns a strictly ascending subset") {
  const PointCloud map = ball(1, 3000, 20.0);
  for (const char* params : {"", "kernel = \"inversion\"", "alpha = 1.0"}) {
    const IndexList indices = seen(map, Point(1, 2, 3), params);
    CHECK(!indices.empty());
    CHECK(indices.size() < map.size());
    CHECK(is_strictly_ascending(indices));
    CHECK(indices.back() < map.size());
  }
}

TEST_CASE("hpr hides a wall behind a wall") {
  const PointCloud front = wall(10.0, 50, 0.05);
  const PointCloud map = joined(front, wall(15.0, 40, 0.05));
  for (const char* params : {"alpha = 100.0", "kernel = \"inversion\""}) {
    const IndexList indices = seen(map, Point(0.01, 0.02, 0.03), params);
    CHECK(indices.size() == front.size());
    CHECK(indices.back() == front.size() - 1);
  }
}

TEST_CASE("hpr sees all of a convex shell from inside") {
  const PointCloud map = sphere(4000, 10.0);
  for (const Point& viewpoint : {Point(0, 0, 0), Point(3, -2, 1)}) {
    CHECK(seen(map, viewpoint).size() == map.size());
    CHECK(seen(map, viewpoint, "kernel = \"inversion\"").size() == map.size());
  }
}

TEST_CASE("hpr answers the same wherever the map lies") {
  const PointCloud map = snapped(ball(2, 4000, 25.0));
  const Point viewpoint(0.5, 0.25, 0.125);
  for (const char* params : {"", "kernel = \"inversion\""}) {
    const IndexList here = seen(map, viewpoint, params);
    for (const Eigen::Vector3d& by :
         {Eigen::Vector3d(1e6, -1e6, 0), Eigen::Vector3d(5e6, 5e6, 1000)}) {
      CHECK(seen(translated(map, by), viewpoint + by, params) == here);
    }
  }
}

TEST_CASE("beyond max_range nothing is seen and nothing occludes") {
  const PointCloud map = ball(3, 4000, 20.0);
  const Point viewpoint(1, 0, 2);
  const double range = 7.0;
  PointCloud near;
  IndexList index_of;
  for (std::uint32_t i = 0; i < map.size(); ++i) {
    if ((map[i] - viewpoint).norm() > range) continue;
    near.push_back(map[i]);
    index_of.push_back(i);
  }
  const auto hpr = plugin<VisibilityOperator>("hpr");
  const auto prepared = hpr->prepare(near, {.map_bounds = bounds_of(map), .max_range = range});
  REQUIRE(prepared);
  auto expected = (*prepared)->visible(viewpoint);
  REQUIRE(expected);
  for (std::uint32_t& i : *expected) i = index_of[i];
  CHECK(seen(map, viewpoint, "", range) == *expected);
  CHECK(seen(map, viewpoint, "", range) != seen(map, viewpoint));
  CHECK(seen(map, Point(100, 0, 0), "", range).empty());
}

TEST_CASE("alpha matters to the flip and not to the inversion") {
  const PointCloud map = ball(4, 4000, 20.0);
  const Point viewpoint(1, 0, 2);
  const auto size = [&](const std::string& params) { return seen(map, viewpoint, params).size(); };
  CHECK(size("alpha = 1.0") < size("alpha = 100.0"));
  CHECK(size("alpha = 100.0") < size("alpha = 10000.0"));
  CHECK(seen(map, viewpoint) == seen(map, viewpoint, "alpha = 100.0"));
  const std::string kernel = "kernel = \"inversion\"\n";
  CHECK(seen(map, viewpoint, kernel + "alpha = 1.0") ==
        seen(map, viewpoint, kernel + "alpha = 10000.0"));
}

TEST_CASE("the order of the points does not matter") {
  const auto check = [](const PointCloud& map, const Point& viewpoint, const char* params) {
    IndexList order(map.size());
    std::iota(order.begin(), order.end(), 0U);
    std::shuffle(order.begin(), order.end(), std::mt19937(5));
    IndexList shuffled_back;
    for (const std::uint32_t i : seen(select(map, order), viewpoint, params)) {
      shuffled_back.push_back(order[i]);
    }
    std::sort(shuffled_back.begin(), shuffled_back.end());
    CHECK(shuffled_back == seen(map, viewpoint, params));
  };
  for (const char* params : {"", "alpha = 1.0", "kernel = \"inversion\""}) {
    CAPTURE(params);
    check(ball(6, 5000, 20.0), {1, 0, 2}, params);
    check(joined(ball(6, 500, 20.0), ball(6, 500, 20.0)), {1, 0, 2}, params);
    check(lattice(5, 0.5), {0.1, 0.2, 0.3}, params);
    check(lattice(5, 0.5), {0.25, 0.25, 0.25}, params);
    check(lattice(5, 0.5), Point::Zero(), params);
    check(wall(3.0, 20, 0.1), Point::Zero(), params);
  }
}

TEST_CASE("concurrent calls agree with serial ones, and visible_from_any is the union") {
  const PointCloud map = ball(7, 20000, 20.0);
  const auto hpr = plugin<VisibilityOperator>("hpr");
  const auto prepared = hpr->prepare(map, {.map_bounds = bounds_of(map)});
  REQUIRE(prepared);
  const auto& scene = **prepared;
  const PointCloud viewpoints = ball(8, 8, 15.0);
  std::vector<Result<IndexList>> serial, parallel(viewpoints.size());
  for (const Point& viewpoint : viewpoints) serial.push_back(scene.visible(viewpoint));
  {
    std::vector<std::jthread> threads;
    for (std::size_t i = 0; i < viewpoints.size(); ++i) {
      threads.emplace_back([&, i] { parallel[i] = scene.visible(viewpoints[i]); });
    }
  }
  std::vector<bool> any(map.size());
  for (std::size_t i = 0; i < viewpoints.size(); ++i) {
    REQUIRE(serial[i]);
    REQUIRE(parallel[i]);
    CHECK(*parallel[i] == *serial[i]);
    for (const std::uint32_t k : *serial[i]) any[k] = true;
  }
  const auto from_any = scene.visible_from_any(viewpoints);
  REQUIRE(from_any);
  for (std::uint32_t k = 0; k < map.size(); ++k) CHECK(contains(*from_any, k) == any[k]);
  CHECK(is_strictly_ascending(*from_any));
}

}  // namespace
}  // namespace vantage::test
