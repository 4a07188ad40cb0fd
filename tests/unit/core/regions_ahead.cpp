#include "localize/regions_ahead.hpp"

#include <doctest/doctest.h>

using namespace vantage;

namespace {

/// Cells of 10 m, 6 along x and 3 along y, by rows; the one in the corner has no map.
MapIndex cells() {
  std::vector<Region> regions;
  for (int y = 0; y < 3; ++y) {
    for (int x = 0; x < 6; ++x) {
      const Eigen::Vector2d min(10.0 * x, 10.0 * y);
      regions.push_back({std::to_string(x) + "_" + std::to_string(y),
                         HalfOpenBox{min, min + Eigen::Vector2d(10, 10)},
                         {}});
    }
  }
  MapIndex index;
  index.partition = Partition::from(std::move(regions)).value();
  index.regions.assign(18, {.points = 5, .viewpoints = 1, .elements = 0, .bytes = 60});
  index.regions[0].points = 0;
  return index;
}

std::vector<std::uint32_t> values(const std::vector<RegionId>& regions) {
  std::vector<std::uint32_t> result;
  for (const RegionId r : regions) result.push_back(r.value);
  return result;
}

}  // namespace

TEST_CASE("regions are expected in the order in which they are reached") {
  const MapIndex index = cells();
  const RegionsAhead ahead(index);
  const auto east = values(ahead({15, 15}, {5, 0}, 5.0, 1.0));
  REQUIRE(east.size() >= 3);
  CHECK(std::vector(east.begin(), east.begin() + 3) == std::vector<std::uint32_t>{7, 8, 9});
  const auto west = values(ahead({35, 15}, {-5, 0}, 2.0, 1.0));
  REQUIRE(west.size() >= 2);
  CHECK(west[0] == 9);
  CHECK(west[1] == 8);
}

TEST_CASE("who stands expects what is near, with a map") {
  const MapIndex index = cells();
  const RegionsAhead ahead(index);
  CHECK(values(ahead({15, 15}, {0, 0}, 5.0, 4.9)) == std::vector<std::uint32_t>{7});
  CHECK(values(ahead({11, 15}, {0, 0}, 5.0, 2.0)) == std::vector<std::uint32_t>{7, 6});
  CHECK(values(ahead({11, 11}, {0, 0}, 5.0, 2.0)) == std::vector<std::uint32_t>{7, 1, 6});
  CHECK(values(ahead({-500, 15}, {0, 0}, 5.0, 2.0)).empty());
}

TEST_CASE("the nearest region with a map") {
  const MapIndex index = cells();
  const RegionsAhead ahead(index);
  CHECK(ahead.nearest({15, 15}) == RegionId{7});
  CHECK(ahead.nearest({2, 8}) == RegionId{6});
  CHECK(ahead.nearest({100, 100}) == RegionId{17});
  CHECK(ahead.at({15, 15, 3}) == RegionId{7});
  CHECK(ahead.at({2, 8, 3}) == RegionId{6});  // its owner has no map
  CHECK(ahead.at({100, 100, 3}) == RegionId{17});
}
