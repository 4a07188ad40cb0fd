#include "vantage/engine/regions_ahead.hpp"

#include <doctest/doctest.h>

#include <random>

#include "vantage/kit/directory_of.hpp"

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

std::vector<std::uint32_t> values(const Result<std::vector<RegionId>>& regions) {
  std::vector<std::uint32_t> result;
  for (const RegionId r : regions.value()) result.push_back(r.value);
  return result;
}

/// The region for a sensor that was in none before.
RegionId chosen(const RegionsAhead& ahead, const Eigen::Vector2d& xy) {
  return ahead.choose(std::nullopt, {xy.x(), xy.y(), 3.0}, 0.0).value().region;
}

}  // namespace

TEST_CASE("a margin keeps a storey in use until the sensor is that far above it") {
  const HalfOpenBox box{{0, 0}, {10, 10}};
  MapIndex index;
  index.partition =
      Partition::from({{"below", box, {-5.0, 3.0}}, {"above", box, {3.0, 10.0}}}).value();
  index.regions.assign(2, {.points = 5, .viewpoints = 1, .elements = 0, .bytes = 60});
  const RegionsAhead ahead(directory_of(index).value());
  const auto at = [&](double z) {
    return ahead.choose(RegionId{0}, {5.0, 5.0, z}, 1.0).value().region.value;
  };
  CHECK(at(2.0) == 0);
  CHECK(at(3.5) == 0);
  CHECK(at(4.5) == 1);
}

TEST_CASE("regions are expected in the order in which they are reached") {
  const RegionsAhead ahead(directory_of(cells()).value());
  const auto east = values(ahead({15, 15}, {5, 0}, 5.0, 1.0));
  REQUIRE(east.size() >= 3);
  CHECK(std::vector(east.begin(), east.begin() + 3) == std::vector<std::uint32_t>{7, 8, 9});
  const auto west = values(ahead({35, 15}, {-5, 0}, 2.0, 1.0));
  REQUIRE(west.size() >= 2);
  CHECK(west[0] == 9);
  CHECK(west[1] == 8);
}

TEST_CASE("who stands expects what is near, with a map") {
  const RegionsAhead ahead(directory_of(cells()).value());
  CHECK(values(ahead({15, 15}, {0, 0}, 5.0, 4.9)) == std::vector<std::uint32_t>{7});
  CHECK(values(ahead({11, 15}, {0, 0}, 5.0, 2.0)) == std::vector<std::uint32_t>{7, 6});
  CHECK(values(ahead({11, 11}, {0, 0}, 5.0, 2.0)) == std::vector<std::uint32_t>{7, 1, 6});
  CHECK(values(ahead({-500, 15}, {0, 0}, 5.0, 2.0)).empty());
}

TEST_CASE("the nearest region with a map") {
  const RegionsAhead ahead(directory_of(cells()).value());
  CHECK(chosen(ahead, {15, 15}) == RegionId{7});
  CHECK(chosen(ahead, {2, 8}) == RegionId{6});  // its owner has no map
  CHECK(chosen(ahead, {100, 100}) == RegionId{17});
}

TEST_CASE("the nearest region with a map, far from all of them and among few") {
  std::mt19937 random(7);
  std::uniform_real_distribution<double> anywhere(-4000.0, 4000.0);
  std::vector<Region> regions;
  for (int r = 0; r < 60; ++r) {
    const Eigen::Vector2d min(anywhere(random), anywhere(random));
    regions.push_back(
        {std::to_string(r), HalfOpenBox{min, min + Eigen::Vector2d::Constant(10.0 * (r + 1))}, {}});
  }
  MapIndex index;
  index.partition = Partition::from(regions).value();
  index.regions.assign(60, {.points = 0, .viewpoints = 1, .elements = 0, .bytes = 60});
  for (std::size_t r = 0; r < 60; r += 7) index.regions[r].points = 5;
  const RegionsAhead ahead(directory_of(index).value());
  for (int k = 0; k < 500; ++k) {
    const Eigen::Vector2d xy =
        (k % 10 == 0 ? 1000.0 : 1.0) * Eigen::Vector2d(anywhere(random), anywhere(random));
    CAPTURE(xy.transpose());
    std::uint32_t nearest = 0;
    for (std::uint32_t r = 0; r < 60; r += 7) {
      if (distance(regions[r].footprint, xy) < distance(regions[nearest].footprint, xy))
        nearest = r;
    }
    CHECK(chosen(ahead, xy) == RegionId{nearest});
  }
}
