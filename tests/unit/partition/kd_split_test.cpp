#include <doctest/doctest.h>

#include <algorithm>
#include <cmath>
#include <random>
#include <set>

#include "support/cut.hpp"
#include "support/plugins.hpp"

namespace vantage {
namespace {

using test::box_of;
using test::kInfinity;
using test::labels;
using test::plugin;

Partition made(const std::string& params, const PointCloud& map) {
  return test::cut_by("kd_split", params, map);
}

/// The points that each region owns; every point must be owned.
std::vector<PointCloud> owned(const Partition& partition, const PointCloud& map) {
  std::vector<PointCloud> points(partition.size());
  for (const Point& p : map) {
    const auto owner = partition.locate(p);
    REQUIRE(owner);
    points[owner->value].push_back(p);
  }
  return points;
}

PointCloud random_map(std::size_t n, double offset, unsigned seed = 3) {
  std::mt19937 random(seed);
  std::uniform_real_distribution<double> x(offset - 50, offset + 50), y(offset - 20, offset + 20);
  PointCloud map;
  for (std::size_t k = 0; k < n; ++k) map.emplace_back(x(random), y(random), x(random));
  return map;
}

TEST_CASE("cells are cut across their longer side, at the median") {
  const PointCloud map{{0, 0, 0}, {1, 3, 0}, {2, 1, 0}, {10, 0, 0}};
  const Partition partition = made("max_points = 1", map);
  // x at 2; then 2 x 3 m across y at 3, and 8 x 3 m across x at 10.
  CHECK(labels(partition) == std::vector<std::string>{"cell_00", "cell_01", "cell_10", "cell_11"});
  CHECK(box_of(partition, 0).min == Eigen::Vector2d(0, 0));
  CHECK(box_of(partition, 0).max == Eigen::Vector2d(2, 3));
  CHECK(box_of(partition, 1).min == Eigen::Vector2d(0, 3));
  CHECK(box_of(partition, 1).max.x() == 2.0);
  CHECK(box_of(partition, 2).min == Eigen::Vector2d(2, 0));
  CHECK(box_of(partition, 2).max.x() == 10.0);
  CHECK(box_of(partition, 3).max ==
        Eigen::Vector2d(std::nextafter(10.0, kInfinity), std::nextafter(3.0, kInfinity)));
}

TEST_CASE("a map that is small enough is one region") {
  const PointCloud map = random_map(100, 0.0);
  CHECK(labels(made("max_points = 100", map)) == std::vector<std::string>{"cell"});
  CHECK(made("max_points = 99", map).size() == 2);
}

TEST_CASE("distinct coordinates are halved exactly, at any distance from the origin") {
  for (const double offset : {0.0, -70.0, 1e6, -5e6}) {
    CAPTURE(offset);
    const PointCloud map = random_map(1024, offset);
    const Partition partition = made("max_points = 64", map);
    CHECK(partition.size() == 16);
    for (const PointCloud& points : owned(partition, map)) CHECK(points.size() == 64);
  }
}

TEST_CASE("cells tile the map's box") {
  const PointCloud map = random_map(3000, 10.0);
  const Partition partition = made("max_points = 50", map);
  std::mt19937 random(8);
  std::uniform_real_distribution<double> x(-45, 65), y(-15, 35);
  const Bounds3 bounds = bounds_of(map);
  const auto check = [&](const Eigen::Vector2d& p) {
    const bool in_map = bounds.min.x() <= p.x() && p.x() <= bounds.max.x() &&
                        bounds.min.y() <= p.y() && p.y() <= bounds.max.y();
    const auto owners =
        std::count_if(partition.regions().begin(), partition.regions().end(),
                      [&](const Region& region) { return contains(region.footprint, p); });
    CHECK(owners == (in_map ? 1 : 0));
  };
  for (int n = 0; n < 2000; ++n) check({x(random), y(random)});
  for (const Point& p : map) check(p.head<2>());
}

TEST_CASE("equal coordinates stay together, and only one place may hold too many points") {
  std::mt19937 random(4);
  for (int round = 0; round < 60; ++round) {
    CAPTURE(round);
    std::uniform_int_distribution<int> x(0, round % 7), y(0, round % 5), heap(0, 3);
    PointCloud map;
    for (int k = 0; k < 200; ++k) {
      const bool is_heaped = heap(random) < round % 4;
      map.emplace_back(is_heaped ? 1.1 : 0.1 * x(random), is_heaped ? -0.7 : 0.1 * y(random), k);
    }
    const Partition partition = made("max_points = 7", map);
    for (const PointCloud& points : owned(partition, map)) {
      CHECK(!points.empty());
      const bool one_place = std::all_of(points.begin(), points.end(), [&](const Point& p) {
        return p.head<2>() == points[0].head<2>();
      });
      CHECK((points.size() <= 7 || one_place));
    }
  }
}

TEST_CASE("the cut is at the value that halves best, and there must be one") {
  const auto cut_of = [](const std::vector<double>& xs) {
    PointCloud map;
    for (const double x : xs) map.emplace_back(x, 0, 0);
    const Partition partition = made("max_points = " + std::to_string(xs.size() - 1), map);
    REQUIRE(partition.size() == 2);
    return box_of(partition, 1).min.x();
  };
  CHECK(cut_of({0, 1, 2, 3}) == 2.0);
  CHECK(cut_of({0, 1, 1, 1, 1, 2, 3}) == 2.0);  // 5 : 2, not 1 : 6
  CHECK(cut_of({0, 1, 2, 2, 2, 2, 3}) == 2.0);  // 2 : 5, not 6 : 1
  CHECK(cut_of({0, 0, 0, 0, 1}) == 1.0);        // the median has nothing below it
  CHECK(cut_of({0, 1, 1, 1, 1}) == 1.0);        // or nothing above it
}

TEST_CASE("the other axis is cut where one cannot be") {
  // 4 x 7 m: y can be cut, but after that neither axis into pieces 3 m wide.
  const PointCloud map{{0, 0, 0}, {0, 7, 0}, {4, 0, 0}, {4, 7, 0}};
  const Partition partition = made("max_points = 1\nmin_width = 3.0", map);
  CHECK(partition.size() == 2);
  CHECK(box_of(partition, 1).min.y() == doctest::Approx(4.0));  // 7 - 3: as near as may be
  // A line along y: x cannot be cut at all.
  CHECK(made("max_points = 1", {{5, 0, 0}, {5, 1, 0}, {5, 2, 0}}).size() == 3);
}

TEST_CASE("no piece is narrower than min_width, whatever that leaves in it") {
  const PointCloud map = random_map(2000, 1e6);
  const Partition partition = made("max_points = 1\nmin_width = 4.0", map);
  CHECK(partition.size() > 50);
  for (std::uint32_t r = 0; r < partition.size(); ++r) {
    const Eigen::Vector2d size = box_of(partition, r).max - box_of(partition, r).min;
    CHECK(size.minCoeff() > 4.0 - 1e-9);
  }
  for (const PointCloud& points : owned(partition, map)) CHECK(!points.empty());
  // A heap in a corner: the cut moves away from the median to keep the width.
  PointCloud heap(100, Point(0, 0, 0));
  heap.emplace_back(0.1, 0, 0);
  heap.emplace_back(10, 0, 0);
  const Partition corner = made("max_points = 10\nmin_width = 4.0", heap);
  REQUIRE(corner.size() == 2);
  CHECK(box_of(corner, 1).min.x() == 4.0);
}

TEST_CASE("one point, one place, a line and a few places far from the origin have regions") {
  CHECK(labels(made("max_points = 1", {{5e6, -5e6, 1}})) == std::vector<std::string>{"cell"});
  CHECK(made("max_points = 1", PointCloud(50, Point(-3, 1e6, 0))).size() == 1);
  PointCloud line;
  for (int k = 0; k < 64; ++k) line.emplace_back(1e6 + 0.25 * k, 1e6 + 0.25 * k, 0);
  CHECK(made("max_points = 1", line).size() == 64);
  const double step = std::nextafter(1e6, kInfinity);
  CHECK(made("max_points = 1", {{1e6, 0, 0}, {step, 0, 0}}).size() == 2);
}

TEST_CASE("the order of the points does not matter, nor the sign of zero") {
  PointCloud map = random_map(999, 0.0);
  for (int k = 0; k < 40; ++k)
    map.emplace_back(k % 2 == 0 ? 0.0 : -0.0, k % 3 == 0 ? -0.0 : 0.0, k);
  const Partition before = made("max_points = 5", map);
  std::mt19937 random(5);
  for (int round = 0; round < 5; ++round) {
    std::shuffle(map.begin(), map.end(), random);
    const Partition after = made("max_points = 5", map);
    CHECK(before.regions() == after.regions());
    for (std::uint32_t r = 0; r < after.size(); ++r) {
      const HalfOpenBox &a = box_of(before, r), &b = box_of(after, r);
      for (int axis = 0; axis < 2; ++axis) {
        CHECK(std::signbit(a.min[axis]) == std::signbit(b.min[axis]));
        CHECK(std::signbit(a.max[axis]) == std::signbit(b.max[axis]));
      }
    }
  }
}

TEST_CASE("labels say the path of cuts and sort as regions do") {
  const auto all = labels(made("max_points = 20", random_map(1000, 0.0)));
  CHECK(std::is_sorted(all.begin(), all.end()));
  CHECK(std::set<std::string>(all.begin(), all.end()).size() == all.size());
}

TEST_CASE("bad maps and parameters are refused") {
  const auto partitioner = plugin<Partitioner>("kd_split", "max_points = 10");
  const PointCloud bad{{0, 0, 0}, {0, std::nan(""), 0}}, far{{0, 0, 0}, {kInfinity, 0, 0}};
  CHECK(test::cut(partitioner, {}).error().code == ErrorCode::invalid_input);
  CHECK(test::cut(partitioner, bad).error().code == ErrorCode::invalid_input);
  CHECK(test::cut(partitioner, far).error().code == ErrorCode::invalid_input);
  for (const std::string params :
       {"", "max_points = 0", "max_points = -1", "max_points = 1.5", "max_point = 10",
        "max_points = 10\nmin_width = -1.0", "max_points = 10\nmin_width = nan"}) {
    CAPTURE(params);
    CHECK_THROWS((void)plugin<Partitioner>("kd_split", params));
  }
}

TEST_CASE("more regions than anybody wants are an error that names the parameter") {
  PointCloud many;
  for (int k = 0; k < 1'000'001; ++k) many.emplace_back(k, 0.0, 0.0);
  const auto partition = test::cut(plugin<Partitioner>("kd_split", "max_points = 1"), many);
  REQUIRE(!partition);
  CHECK(partition.error().code == ErrorCode::invalid_input);
  CHECK(partition.error().message == "max_points = 1 cuts the map into more than 1000000 regions");
}

}  // namespace
}  // namespace vantage
