#include "vantage/kit/raster_partition.hpp"

#include <doctest/doctest.h>

#include <algorithm>
#include <cmath>
#include <random>

#include "vantage/kit/map_in_memory.hpp"

namespace vantage {
namespace {

using Eigen::Vector2d;

constexpr double kInfinity = std::numeric_limits<double>::infinity();

template <class T>
T value(Result<T> result) {
  REQUIRE_MESSAGE(result, to_string(result.error()));
  return *std::move(result);
}

template <class T>
void refuses(const Result<T>& result, const std::string& because) {
  REQUIRE(!result);
  CHECK(result.error().code == ErrorCode::invalid_input);
  CHECK_MESSAGE(result.error().message.find(because) != std::string::npos, result.error().message);
}

PlanRaster raster(double cell_size, double extent = 1000.0) {
  return value(PlanRaster::over({{-extent, -extent, 0}, {extent, extent, 0}}, cell_size));
}

PointCloud random_map(std::size_t n, double extent, double offset, unsigned seed) {
  std::mt19937 random(seed);
  std::uniform_real_distribution<double> coordinate(offset - extent, offset + extent);
  PointCloud map;
  for (std::size_t k = 0; k < n; ++k) map.emplace_back(coordinate(random), coordinate(random), 0.0);
  return map;
}

std::vector<Seed> random_seeds(std::size_t n, double extent, double offset, unsigned seed) {
  std::mt19937 random(seed);
  std::uniform_real_distribution<double> coordinate(offset - extent, offset + extent);
  std::uniform_real_distribution<double> length(-4.0, 4.0);
  std::vector<Seed> seeds;
  for (std::uint32_t k = 0; k < n; ++k) {
    const Vector2d from(coordinate(random), coordinate(random));
    seeds.push_back({from, from + Vector2d(length(random), k % 3 == 0 ? 0.0 : length(random)), k});
  }
  return seeds;
}

std::vector<std::string> names(std::size_t n) {
  std::vector<std::string> all;
  for (std::size_t k = 0; k < n; ++k) all.push_back("r" + std::to_string(k));
  return all;
}

double distance_to(const Seed& seed, const Vector2d& p) {
  const Vector2d along = seed.to - seed.from;
  const double t = along.isZero(0.0) ? 0.0 : (p - seed.from).dot(along) / along.squaredNorm();
  return (p - seed.from - std::clamp(t, 0.0, 1.0) * along).norm();
}

TEST_CASE("a cell begins on its edge and ends below the next") {
  const PlanRaster cells = raster(0.1);
  for (int i = -300; i < 300; ++i) {
    const double edge = i * 0.1;
    CHECK(cells.corner(i, 0).x() == edge);
    CHECK(cells.cell_of({edge, 0.05}) == PlanCell{0, i});
    CHECK(cells.cell_of({std::nextafter(edge, -kInfinity), 0.05}) == PlanCell{0, i - 1});
  }
}

TEST_CASE("cells that are too small for the map are refused") {
  const auto over = [](double extent, double cell_size) {
    return PlanRaster::over({{-extent, 0, 0}, {0, 0, 0}}, cell_size);
  };
  CHECK(over(2e9, 1.0));
  refuses(over(2.2e9, 1.0), "cell_size = 1 m is too small");
  refuses(over(1e300, 1.0), "2^31");
  refuses(over(1.0, 1e-300), "too small");
  CHECK(over(0.0, 1e-300));
}

TEST_CASE("occupied cells are listed once, by rows") {
  const PointCloud points{
      {2.5, 0.5, 0}, {0.5, 0.5, 7}, {-0.5, 1.5, 0}, {2.9, 0.1, 0}, {2.5, 0.5, 0}};
  CHECK(value(occupied_cells(MapInMemory(points), raster(1.0))) ==
        std::vector<PlanCell>{{0, 0}, {0, 2}, {1, -1}});
}

TEST_CASE("cells are joined into rectangles") {
  // 1 1 1
  // 0 0 1     rows 1, 0: region 0 is a square, region 1 the rest
  // 0 0 . 1
  const std::vector<OwnedCell> cells{{{0, 0}, 0}, {{0, 1}, 0}, {{1, 0}, 0},
                                     {{1, 1}, 0}, {{1, 2}, 1}, {{2, 0}, 1},
                                     {{2, 1}, 1}, {{2, 2}, 1}, {{0, 3}, 1}};
  const Partition partition = value(partition_of_cells(raster(10.0), cells, names(2)));
  REQUIRE(partition.size() == 2);
  CHECK(partition.regions()[0] == Region{"r0", HalfOpenBox{{0, 0}, {20, 20}}, {}});
  const auto& boxes = std::get<BoxUnion>(partition.regions()[1].footprint).boxes;
  CHECK(boxes ==
        std::vector<HalfOpenBox>{{{30, 0}, {40, 10}}, {{20, 10}, {30, 20}}, {{0, 20}, {30, 30}}});
}

TEST_CASE("runs of the same width join across rows only if the rows touch") {
  const std::vector<OwnedCell> cells{
      {{0, 0}, 0}, {{2, 0}, 0}, {{3, 0}, 0}, {{3, 2}, 0}, {{4, 2}, 0}};
  const Partition partition = value(partition_of_cells(raster(1.0), cells, names(1)));
  CHECK(std::get<BoxUnion>(partition.regions()[0].footprint).boxes ==
        std::vector<HalfOpenBox>{{{0, 0}, {1, 1}}, {{0, 2}, {1, 4}}, {{2, 3}, {3, 5}}});
}

TEST_CASE("a partition of random cells locates every cell where it belongs, in any order") {
  std::mt19937 random(3);
  std::vector<OwnedCell> cells;
  for (std::int32_t j = -20; j < 20; ++j) {
    for (std::int32_t i = -20; i < 20; ++i) {
      const auto region = static_cast<std::uint32_t>(random() % 5);
      if (region < 4) cells.push_back({{j, i}, region});
    }
  }
  const PlanRaster small = raster(0.3);
  const Partition partition = value(partition_of_cells(small, cells, names(4)));
  std::size_t boxes = 0;
  for (const Region& region : partition.regions()) {
    boxes += std::get<BoxUnion>(region.footprint).boxes.size();
  }
  CHECK(boxes < cells.size());
  for (const OwnedCell& cell : cells) {
    CHECK(partition.locate(small.centre(cell.cell)) == RegionId{cell.region});
    CHECK(partition.locate(small.corner(cell.cell.i, cell.cell.j)) == RegionId{cell.region});
  }
  std::shuffle(cells.begin(), cells.end(), random);
  CHECK(value(partition_of_cells(small, cells, names(4))).regions() == partition.regions());
}

TEST_CASE("cells that make no partition are refused") {
  const PlanRaster cells = raster(1.0);
  refuses(partition_of_cells(cells, {{{0, 3}, 0}, {{0, 3}, 0}}, names(1)),
          "cell (3, 0) is named twice");
  refuses(partition_of_cells(cells, {{{0, 0}, 1}}, names(1)), "region 1, but there are 1");
  refuses(partition_of_cells(cells, {{{0, 0}, 0}}, names(2)), "no box");
  refuses(partition_of_cells(cells, {}, {}), "needs a region");
}

TEST_CASE("every place belongs to the nearest seed: compared with trying all") {
  for (const double offset : {0.0, 1e6, -5e6}) {
    CAPTURE(offset);
    const PointCloud map = random_map(3000, 40.0, offset, 7);
    const std::vector<Seed> seeds = random_seeds(60, 40.0, offset, 8);
    const NearestParams params{.cell_size = 1.0, .fill_radius = 3.0};
    const Partition partition =
        value(partition_by_nearest(MapInMemory(map), seeds, names(60), params));
    const PlanRaster cells = value(PlanRaster::over(bounds_of(map), 1.0));
    const Bounds3 bounds = bounds_of(map);
    const PlanCell low = cells.cell_of(bounds.min.head<2>());
    const PlanCell high = cells.cell_of(bounds.max.head<2>());
    const std::vector<PlanCell> occupied = value(occupied_cells(MapInMemory(map), cells));
    int owned = 0, empty = 0;
    for (std::int32_t j = low.j; j <= high.j; ++j) {
      for (std::int32_t i = low.i; i <= high.i; ++i) {
        const Vector2d centre = cells.centre({j, i});
        double least = kInfinity;
        for (const Seed& seed : seeds) {
          if (std::any_of(
                  partition.regions().begin(), partition.regions().end(),
                  [&](const Region& r) { return r.label == "r" + std::to_string(seed.region); })) {
            least = std::min(least, distance_to(seed, centre));
          }
        }
        const bool is_occupied =
            std::binary_search(occupied.begin(), occupied.end(), PlanCell{j, i});
        const auto owner = partition.locate(centre);
        REQUIRE(owner.has_value() == (is_occupied || least <= 3.0));
        ++(owner ? owned : empty);
        if (!owner) continue;
        const std::string& label = partition[*owner].label;
        const auto region = static_cast<std::size_t>(std::stoi(label.substr(1)));
        CHECK(distance_to(seeds[region], centre) <= least + 1e-9);
      }
    }
    CHECK(owned > 2000);
    CHECK(empty > 100);
  }
}

TEST_CASE("of two seeds as near, the region with the lower number owns the place") {
  const PointCloud map{{0.5, 0.5, 0}, {9.5, 0.5, 0}, {4.5, 0.5, 0}};
  const std::vector<Seed> seeds{{{8.5, 0.5}, {8.5, 0.5}, 1}, {{0.5, 0.5}, {0.5, 0.5}, 0}};
  const Partition partition = value(partition_by_nearest(MapInMemory(map), seeds, names(2), {}));
  CHECK(partition.locate(Vector2d(4.5, 0.5)) == RegionId{0});
  CHECK(partition.locate(Vector2d(5.5, 0.5)) == std::nullopt);
}

TEST_CASE("a region without a point is left out and its places go to the next nearest") {
  const PointCloud map{{0.5, 0.5, 0}, {20.5, 0.5, 0}};
  const std::vector<Seed> seeds{
      {{0.5, 0.5}, {0.5, 0.5}, 0}, {{9.5, 0.5}, {9.5, 0.5}, 1}, {{20.5, 0.5}, {20.5, 0.5}, 2}};
  const Partition partition = value(partition_by_nearest(MapInMemory(map), seeds, names(3),
                                                         {.cell_size = 1.0, .fill_radius = 2.0}));
  REQUIRE(partition.size() == 2);
  CHECK(partition.regions()[1].label == "r2");
  CHECK(partition.locate(Vector2d(9.5, 0.5)) == RegionId{0});
  CHECK(partition.locate(Vector2d(11.5, 0.5)) == RegionId{1});
  CHECK(partition.locate(Vector2d(5.5, 0.5)) == std::nullopt);
}

TEST_CASE("the order of the points does not matter") {
  PointCloud map = random_map(2000, 30.0, 0.0, 9);
  const std::vector<Seed> seeds = random_seeds(20, 30.0, 0.0, 10);
  const NearestParams params{.cell_size = 0.7, .fill_radius = 2.0};
  const auto before =
      value(partition_by_nearest(MapInMemory(map), seeds, names(20), params)).regions();
  std::shuffle(map.begin(), map.end(), std::mt19937(1));
  CHECK(value(partition_by_nearest(MapInMemory(map), seeds, names(20), params)).regions() ==
        before);
}

TEST_CASE("a seed whose distance is beyond all numbers still owns the map") {
  const std::vector<Seed> seeds{{{1e300, 0}, {1e300, 0}, 0}};
  const PointCloud map{{1, 2, 3}};
  CHECK(value(partition_by_nearest(MapInMemory(map), seeds, names(1), {})).locate(map[0]) ==
        RegionId{0});
}

TEST_CASE("what makes no regions is refused") {
  const PointCloud map{{0, 0, 0}, {100, 100, 0}};
  const std::vector<Seed> seed{{{0, 0}, {0, 0}, 0}};
  refuses(partition_by_nearest(MapInMemory({}), seed, names(1), {}), "no points");
  refuses(partition_by_nearest(MapInMemory(map), {}, names(1), {}), "no seed");
  refuses(partition_by_nearest(MapInMemory(map), seed, {}, {}), "names region 0");
  const std::vector<Seed> bad{{{0, std::nan("")}, {0, 0}, 0}};
  refuses(partition_by_nearest(MapInMemory(map), bad, names(1), {}), "not finite");
  refuses(partition_by_nearest(MapInMemory(map), seed, names(1),
                               {.cell_size = 1e-4, .fill_radius = 50.0}),
          "fill_radius = 50 m make more than 100000000 cells");
  refuses(partition_by_nearest(MapInMemory(map), seed, names(1),
                               {.cell_size = 1e-6, .fill_radius = 1e300}),
          "more than 100000000 cells");
}

}  // namespace
}  // namespace vantage
