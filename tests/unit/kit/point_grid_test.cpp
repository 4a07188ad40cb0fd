#include "vantage/kit/point_grid.hpp"

#include <doctest/doctest.h>

#include <cmath>
#include <limits>
#include <random>
#include <set>

namespace vantage {
namespace {

PointCloud scattered(std::size_t count) {
  std::mt19937 random(11);
  std::uniform_real_distribution<double> coordinate(-9.0, 9.0);
  PointCloud points(count);
  for (Point& p : points) p = {coordinate(random), coordinate(random), coordinate(random)};
  return points;
}

Point cell_of(const Point& p, double width) { return (p / width).array().floor() + 0.0; }

TEST_CASE("a grid has every point once, in the one cell where it lies, in a tight box") {
  const PointCloud map = scattered(2000);
  const PointGrid grid(map, 1.5);
  std::set<std::uint32_t> all;
  std::set<std::array<double, 3>> cells;
  for (const PointGrid::Cell& cell : grid.cells()) {
    const auto indices = grid.indices(cell);
    REQUIRE_FALSE(indices.empty());
    CHECK(std::is_sorted(indices.begin(), indices.end()));
    Bounds3 bounds;
    const Point here = cell_of(map[indices.front()], 1.5);
    CHECK(cells.insert({here.x(), here.y(), here.z()}).second);
    for (const std::uint32_t i : indices) {
      CHECK(all.insert(i).second);
      CHECK(cell_of(map[i], 1.5) == here);
      bounds.extend(map[i]);
    }
    CHECK(cell.bounds.min == bounds.min);
    CHECK(cell.bounds.max == bounds.max);
  }
  CHECK(all.size() == map.size());
}

TEST_CASE("every point within range is among those near, and whole cells out of range are not") {
  const PointCloud map = scattered(2000);
  const PointGrid grid(map, 2.0);
  const Point place(1.0, -2.0, 3.0);
  std::set<std::uint32_t> near;
  grid.for_each_near(place, 4.0, [&](std::uint32_t i) { CHECK(near.insert(i).second); });
  for (std::uint32_t i = 0; i < map.size(); ++i) {
    const double distance = (map[i] - place).norm();
    if (distance <= 4.0) CHECK(near.contains(i));
    if (distance > 4.0 + 2.0 * std::sqrt(3.0)) CHECK_FALSE(near.contains(i));
  }
}

TEST_CASE("infinitely wide cells are one, also across the origin; no points make none") {
  const PointCloud map{{-1.0, -1.0, -1.0}, {1.0, 1.0, 1.0}};
  CHECK(PointGrid(map, std::numeric_limits<double>::infinity()).cells().size() == 1);
  CHECK(PointGrid({}, 1.0).cells().empty());
}

}  // namespace
}  // namespace vantage
