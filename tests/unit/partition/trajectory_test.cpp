#include <doctest/doctest.h>

#include <algorithm>
#include <cmath>
#include <numbers>
#include <random>

#include "support/cut.hpp"
#include "support/plugins.hpp"

namespace vantage {
namespace {

using Eigen::Vector2d;
using test::floor;
using test::kInfinity;
using test::plugin;

PluginPtr<Partitioner> along(const std::string& params) {
  return plugin<Partitioner>("trajectory", params);
}

Partition made(const std::string& params, const PointCloud& map, const PointCloud& path) {
  return test::cut_by("trajectory", params, map, path);
}

/// Positions every metre or less along straight lines.
PointCloud drive(const std::vector<Vector2d>& corners, const Point& offset = Point::Zero()) {
  PointCloud path;
  for (std::size_t k = 1; k < corners.size(); ++k) {
    const Vector2d to = corners[k] - corners[k - 1];
    const int n = std::max(1, static_cast<int>(std::ceil(to.norm())));
    for (int s = 0; s < n; ++s) {
      const Vector2d p = corners[k - 1] + to * s / n;
      path.push_back(offset + Point(p.x(), p.y(), 1.7));
    }
  }
  path.push_back(offset + Point(corners.back().x(), corners.back().y(), 1.7));
  return path;
}

std::string owner(const Partition& partition, double x, double y) {
  const auto id = partition.locate(Vector2d(x, y));
  return id ? partition[*id].label : "none";
}

/// How often the region changes along a path.
int switches(const Partition& partition, const PointCloud& path) {
  int count = 0;
  for (std::size_t k = 1; k < path.size(); ++k) {
    if (partition.locate(path[k]) != partition.locate(path[k - 1])) ++count;
  }
  return count;
}

TEST_CASE("a straight drive is cut every segment_length, across the whole map") {
  const PointCloud map = floor(0, 100, -30, 30);
  const Partition partition = made("segment_length = 20.0", map, drive({{0, 0}, {100, 0}}));
  REQUIRE(partition.size() == 5);
  for (std::size_t s = 0; s < 5; ++s) {
    const Region& region = partition.regions()[s];
    CHECK(region.label == "segment_00" + std::to_string(s));
    const double x = 20.0 * static_cast<double>(s);
    CHECK(std::get<HalfOpenBox>(region.footprint) == HalfOpenBox{{x, -30}, {x + 20, 30}});
  }
}

TEST_CASE("a rest shorter than half a segment joins its predecessor") {
  const PointCloud map = floor(0, 120, -3, 3);
  CHECK(made("segment_length = 20.0", map, drive({{0, 0}, {108, 0}})).size() == 5);
  CHECK(made("segment_length = 20.0", map, drive({{0, 0}, {112, 0}})).size() == 6);
  CHECK(made("segment_length = 20.0", map, drive({{0, 0}, {7, 0}})).size() == 1);
}

TEST_CASE("arc length counts, not the number of positions") {
  const PointCloud map = floor(0, 100, -3, 3);
  const std::string params = "segment_length = 20.0";
  const auto dense = made(params, map, drive({{0, 0}, {100, 0}})).regions();
  CHECK(made(params, map, {{0, 0, 0}, {100, 0, 5}}).regions() == dense);
  CHECK(made(params, map, {{0, 0, 0}, {33, 0, 0}, {33, 0, 0}, {34, 0, 0}, {100, 0, 9}}).regions() ==
        dense);
}

TEST_CASE("driving back along the same street uses the same regions") {
  const PointCloud map = floor(0, 210, -20, 20);
  const PointCloud there = drive({{0, -2}, {200, -2}});
  const Partition once = made("segment_length = 20.0", map, there);
  // In the other lane, after a turn.
  const PointCloud both = drive({{0, -2}, {200, -2}, {200, 2}, {0, 2}});
  const Partition twice = made("segment_length = 20.0", map, both);
  CHECK(twice.size() == once.size());
  CHECK(switches(twice, both) == 18);
  for (int x = 0; x < 200; ++x) CHECK(owner(twice, x + 0.5, -2) == owner(twice, x + 0.5, 2));
  // And a third and a fourth time.
  PointCloud again = both;
  again.insert(again.end(), both.begin(), both.end());
  CHECK(made("segment_length = 20.0", map, again).size() == once.size());
}

TEST_CASE("without revisit_distance every pass has regions of its own") {
  const PointCloud map = floor(0, 100, -20, 20);
  const PointCloud both = drive({{0, -6}, {100, -6}, {100, 6}, {0, 6}});
  const Partition partition = made("segment_length = 20.0\nrevisit_distance = 0.0", map, both);
  CHECK(partition.size() == 11);
  CHECK(owner(partition, 50, -6) != owner(partition, 50, 6));
}

TEST_CASE("a street that is far enough away is another place") {
  const PointCloud map = floor(0, 110, 0, 60);
  const PointCloud path = drive({{0, 5}, {100, 5}, {100, 45}, {0, 45}});
  const Partition partition = made("segment_length = 20.0", map, path);
  CHECK(partition.size() == 12);
  CHECK(switches(partition, path) == 11);
}

TEST_CASE("the second lap of a closed loop adds nothing") {
  const PointCloud map = floor(-60, 60, -60, 60);
  PointCloud lap;
  for (int k = 0; k <= 360; ++k) {
    const double a = k * std::numbers::pi / 180.0;
    lap.emplace_back(40 * std::cos(a), 40 * std::sin(a), 0.0);
  }
  PointCloud laps = lap;
  for (int n = 0; n < 3; ++n) laps.insert(laps.end(), lap.begin(), lap.end());
  const Partition one = made("segment_length = 25.0", map, lap);
  CHECK(one.size() == 10);  // 251 m
  CHECK(switches(one, lap) == 10);
  CHECK(made("segment_length = 25.0", map, laps).regions() == one.regions());
}

TEST_CASE("a crossing belongs to the street that was driven first") {
  const PointCloud map = floor(-100, 100, -100, 100);
  const PointCloud path = drive({{-90, 0}, {90, 0}, {90, 90}, {0, 90}, {0, -90}});
  const Partition partition = made("segment_length = 30.0", map, path);
  const std::string crossing = owner(partition, 0.5, 0.5);
  CHECK(owner(partition, 0.5, 6) == crossing);
  CHECK(owner(partition, 0.5, -6) == crossing);
  CHECK(owner(partition, 0.5, 12) != crossing);
}

TEST_CASE("a vehicle that stands still drives nowhere, whatever its receiver says") {
  std::mt19937 random(4);
  std::normal_distribution<double> noise(0.0, 0.1);
  PointCloud path;
  for (int k = 0; k < 5000; ++k) path.emplace_back(5 + noise(random), 5 + noise(random), 0.0);
  const PointCloud map = floor(0, 10, 0, 10);
  CHECK(made("segment_length = 30.0", map, path).size() == 1);
  CHECK(made("segment_length = 30.0", map, {{5, 5, 0}}).size() == 1);
  CHECK(made("segment_length = 30.0", map, {{5, 5, 0}, {5, 5, 0}}).size() == 1);
}

TEST_CASE("places near the path are owned though the map shows nothing there") {
  PointCloud map = floor(0, 100, 20, 30);
  map.push_back({0.5, -19.5, 0});
  const PointCloud path = drive({{0, 0}, {100, 0}});
  const Partition by_default = made("segment_length = 20.0", map, path);
  CHECK(owner(by_default, 50, 0) == "segment_002");
  CHECK(owner(by_default, 50, 9) == "segment_002");
  CHECK(owner(by_default, 50, 11) == "none");
  CHECK(owner(by_default, 50, -9) == "segment_002");
  CHECK(owner(by_default, -2, 0) == "none");  // outside the map's box
  const Partition none = made("segment_length = 20.0\nfill_radius = 0.0", map, path);
  CHECK(owner(none, 50, 3) == "none");
}

TEST_CASE("a segment without a map point is left out") {
  PointCloud map = floor(0, 20, -2, 2);
  for (const Point& p : floor(60, 80, -2, 2)) map.push_back(p);
  const Partition partition = made("segment_length = 20.0", map, drive({{0, 0}, {80, 0}}));
  REQUIRE(partition.size() == 2);
  CHECK(partition.regions()[1].label == "segment_003");
  CHECK(owner(partition, 30, 0) == "segment_000");
  CHECK(owner(partition, 50, 0) == "segment_003");
}

TEST_CASE("every map point is located, also on edges and far from the origin; no region is empty") {
  for (const double offset : {0.0, -0.05, 1e6, -5e6}) {
    CAPTURE(offset);
    const PointCloud map = test::lattice(60, 0.1, offset);
    const PointCloud path{{offset, offset, 0}, {offset + 6, offset + 6, 0}};
    for (const std::string params :
         {"segment_length = 1.0\ncell_size = 0.1", "segment_length = 0.5\ncell_size = 0.3",
          "segment_length = 2.0"}) {
      CAPTURE(params);
      const Partition partition = made(params, map, path);
      test::check_every_region_owns(partition, map);
    }
  }
}

TEST_CASE("a moved world has the same regions, moved") {
  const Point offset(1e6, -2e6, 0);
  const PointCloud path = drive({{0, 0}, {60, 0}, {60, 50}});
  const PointCloud moved = drive({{0, 0}, {60, 0}, {60, 50}}, offset);
  const Partition here = made("segment_length = 20.0", floor(-10, 70, -10, 60), path);
  const Partition there = made("segment_length = 20.0", floor(-10, 70, -10, 60, offset), moved);
  REQUIRE(here.size() == there.size());
  for (const Point& p : floor(-10, 70, -10, 60))
    CHECK(here.locate(p) == there.locate(Point(p + offset)));
}

TEST_CASE("the order of the points does not matter") {
  PointCloud map = floor(0, 80, -20, 20);
  const PointCloud path = drive({{0, 0}, {40, 0}, {70, 15}});
  const auto before = made("segment_length = 15.0", map, path).regions();
  std::shuffle(map.begin(), map.end(), std::mt19937(6));
  CHECK(made("segment_length = 15.0", map, path).regions() == before);
}

TEST_CASE("small maps have regions: one point, equal points, a line") {
  const PointCloud path = drive({{0, 0}, {50, 0}});
  CHECK(made("segment_length = 20.0", {{7, 3, 1}}, path).size() == 1);
  CHECK(made("segment_length = 20.0", PointCloud(50, Point(7, 3, 1)), path).size() == 1);
  CHECK(made("segment_length = 20.0", {{1, 0, 0}, {25, 0, 0}, {49, 0, 0}}, path).size() == 3);
}

TEST_CASE("bad input is refused") {
  const auto refused = [](const std::string& params, const PointCloud& map, const PointCloud& path,
                          const std::string& because) {
    const auto partition = test::cut(along(params), map, path);
    REQUIRE(!partition);
    CHECK(partition.error().code == ErrorCode::invalid_input);
    CHECK_MESSAGE(partition.error().message.find(because) != std::string::npos,
                  partition.error().message);
  };
  const std::string ok = "segment_length = 20.0";
  const PointCloud map = floor(0, 10, 0, 10), path = drive({{0, 0}, {50, 0}});
  refused(ok, {}, path, "the map has no points");
  refused(ok, {{0, kInfinity, 0}}, path, "not finite");
  refused(ok, map, {}, "map.trajectory");
  refused(ok, map, {{0, 0, 0}, {std::nan(""), 0, 0}},
          "map.trajectory) has a point that is not finite");
  refused(ok, map, {{0, 0, 0}, {1e9, 0, 0}}, "segment_length = 20 m is too small");
  refused(ok, map, {{0, 0, 0}, {1e300, -1e300, 0}}, "too small for a trajectory");
  refused("segment_length = 20.0\ncell_size = 1e-9", {{5e6, 5e6, 0}}, path, "cell_size = 1e-09 m");
  refused("segment_length = 20.0\ncell_size = 1e-5", map, path, "100000000 cells");
}

TEST_CASE("bad parameters are refused") {
  for (const std::string params :
       {"", "segment_length = 0.0", "segment_length = -1.0", "segment_length = nan",
        "segment_length = 20.0\ncell_size = 0.0", "segment_length = 20.0\nfill_radius = -1.0",
        "segment_length = 20.0\nrevisit_distance = -1.0", "segment_lenght = 20.0"}) {
    CAPTURE(params);
    CHECK_THROWS((void)along(params));
  }
}

}  // namespace
}  // namespace vantage
