#include <doctest/doctest.h>

#include <cmath>
#include <random>

#include "support/cut.hpp"
#include "support/plugins.hpp"

namespace vantage {
namespace {

using test::plugin;

Partition whole(const std::string& params, const PointCloud& map) {
  return test::cut_by("whole_map", params, map);
}

TEST_CASE("one region called map owns every point, the greatest too") {
  std::mt19937 random(2);
  for (const double offset : {0.0, -1e6, 5e6}) {
    std::uniform_real_distribution<double> coordinate(offset - 30, offset + 30);
    PointCloud map;
    for (int k = 0; k < 500; ++k) {
      map.emplace_back(coordinate(random), coordinate(random), coordinate(random));
    }
    const Partition partition = whole("", map);
    REQUIRE(partition.size() == 1);
    CHECK(partition.regions()[0].label == "map");
    for (const Point& p : map) CHECK(partition.locate(p) == RegionId{0});
    const Bounds3 bounds = bounds_of(map);
    CHECK(partition.locate(bounds.max) == RegionId{0});
    CHECK(!partition.locate(Point(bounds.max.x() + 0.01, bounds.min.y(), 0)));
  }
}

TEST_CASE("the margin widens the region on every side") {
  const Partition partition = whole("margin = 5.0", {{0, 0, 0}, {10, 20, 0}});
  const auto& box = std::get<HalfOpenBox>(partition.regions()[0].footprint);
  CHECK(box.min == Eigen::Vector2d(-5, -5));
  CHECK(partition.locate(Point(15, 25, 0)) == RegionId{0});
  CHECK(!partition.locate(Point(15.01, 25, 0)));
}

TEST_CASE("one point, and points on a line, have a region with an inside") {
  CHECK(whole("", {{5e6, 5e6, 1}}).locate(Point(5e6, 5e6, 1)) == RegionId{0});
  CHECK(whole("", {{1, 0, 0}, {2, 0, 0}}).locate(Point(2, 0, 0)) == RegionId{0});
}

TEST_CASE("bad maps and parameters are refused") {
  const auto whole = plugin<Partitioner>("whole_map");
  CHECK(test::cut(whole, {}).error().code == ErrorCode::invalid_input);
  const PointCloud bad{{0, 0, 0}, {std::nan(""), 0, 0}};
  CHECK(test::cut(whole, bad).error().code == ErrorCode::invalid_input);
  CHECK_THROWS((void)plugin<Partitioner>("whole_map", "margin = -1.0"));
  CHECK_THROWS((void)plugin<Partitioner>("whole_map", "cell_width = 1.0"));
}

}  // namespace
}  // namespace vantage
