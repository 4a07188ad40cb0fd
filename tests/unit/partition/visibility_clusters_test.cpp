#include <doctest/doctest.h>
#include <tbb/global_control.h>

#include <algorithm>
#include <cmath>
#include <functional>
#include <random>
#include <set>

#include "clustering.hpp"
#include "support/cut.hpp"
#include "support/plugins.hpp"
#include "vantage/map_survey.hpp"

namespace vantage {
namespace {

using Eigen::Vector2d;
using test::floor;
using test::kInfinity;
using test::plugin;
namespace clusters = visibility_clusters;

PluginPtr<Partitioner> by_sight(const std::string& params) {
  return plugin<Partitioner>("visibility_clusters", params);
}

/// Viewpoints where a test wants them, that see what it wants.
struct Told final : MapSurvey {
  PointsView map;
  PointCloud places;
  std::function<bool(const Point& from, const Point& p)> sees;

  [[nodiscard]] Result<PointCloud> viewpoints() const noexcept override { return places; }
  [[nodiscard]] Result<Bounds3> ground_bounds() const noexcept override {
    return bounds_of(places);
  }
  [[nodiscard]] Result<IndexList> visible(const Point& from) const noexcept override {
    if (!sees) {
      return fail(ErrorCode::internal, "blind at " + std::to_string(std::lround(from.x())));
    }
    IndexList seen;
    for (std::uint32_t k = 0; k < map.size(); ++k) {
      if (sees(from, map[k])) seen.push_back(k);
    }
    return seen;
  }
  [[nodiscard]] Result<std::uint64_t> observable_points(const Region&,
                                                        std::uint64_t) const noexcept override {
    return std::uint64_t{0};
  }
};

/// Viewpoints every 2 m over a floor.
PointCloud viewpoints_over_floor(int x0, int x1, int y0, int y1) {
  PointCloud places;
  for (int y = y0 + 1; y < y1; y += 2) {
    for (int x = x0 + 1; x < x1; x += 2) places.emplace_back(x, y, 1.0);
  }
  return places;
}

/// Two rooms of 20 x 10 m, side by side, with a wall at x = 20.
Told two_rooms(const PointCloud& map) {
  Told survey;
  survey.map = map;
  survey.places = viewpoints_over_floor(0, 40, 0, 10);
  survey.sees = [](const Point& from, const Point& p) { return (from.x() < 20) == (p.x() < 20); };
  return survey;
}

Partition made(const std::string& params, const PointCloud& map, const MapSurvey& survey) {
  auto partition = by_sight(params)->partition(MapInMemory(map), {}, survey);
  REQUIRE_MESSAGE(partition, to_string(partition.error()));
  return *std::move(partition);
}

std::vector<clusters::Voxels> random_sets(std::size_t n, unsigned seed) {
  std::mt19937 random(seed);
  std::vector<clusters::Voxels> sets(n);
  for (std::size_t k = 0; k < n; ++k) {
    // Sets of neighbouring numbers have more in common.
    for (std::uint32_t v = 0; v < 400; ++v) {
      const double away =
          std::abs(static_cast<double>(v) - 400.0 * static_cast<double>(k % 12) / 12.0);
      if (static_cast<double>(random() % 400) > 2 * away + 60) sets[k].push_back(v);
    }
  }
  return sets;
}

std::vector<Vector2d> random_places(std::size_t n, unsigned seed) {
  std::mt19937 random(seed);
  std::uniform_real_distribution<double> coordinate(0.0, 50.0);
  std::vector<Vector2d> places;
  for (std::size_t k = 0; k < n; ++k) places.emplace_back(coordinate(random), coordinate(random));
  return places;
}

/// The definition, word for word.
std::vector<std::uint32_t> group_slowly(const std::vector<Vector2d>& places,
                                        const std::vector<clusters::Voxels>& seen,
                                        const std::vector<clusters::Neighbours>& neighbours,
                                        const clusters::GroupLimits& limits) {
  std::vector<std::uint32_t> of(places.size());  // by lowest viewpoint
  for (std::uint32_t k = 0; k < of.size(); ++k) of[k] = k;
  const auto members = [&](std::uint32_t g) {
    std::vector<std::uint32_t> all;
    for (std::uint32_t k = 0; k < of.size(); ++k) {
      if (of[k] == g) all.push_back(k);
    }
    return all;
  };
  while (true) {
    double best = limits.min_overlap;
    std::pair<std::uint32_t, std::uint32_t> pair{0, 0};
    std::set<std::pair<std::uint32_t, std::uint32_t>> adjacent;
    for (const auto& [a, b] : neighbours) {
      if (of[a] != of[b]) adjacent.insert(std::minmax(of[a], of[b]));
    }
    for (const auto& [a, b] : adjacent) {
      const auto here = members(a), there = members(b);
      double sum = 0.0;
      Vector2d low = places[a], high = places[a];
      for (const auto& side : {here, there}) {
        for (const std::uint32_t k : side) {
          low = low.cwiseMin(places[k]);
          high = high.cwiseMax(places[k]);
        }
      }
      if ((high - low).maxCoeff() > limits.max_width) continue;
      for (const std::uint32_t x : here) {
        for (const std::uint32_t y : there) sum += clusters::overlap(seen[x], seen[y]);
      }
      const double mean = sum / static_cast<double>(here.size() * there.size());
      if (mean > best || (mean == best && pair.first == pair.second)) {
        best = mean;
        pair = {a, b};
      }
    }
    if (pair.first == pair.second) return of;
    std::replace(of.begin(), of.end(), pair.second, pair.first);
  }
}

TEST_CASE("overlap is the Jaccard index") {
  CHECK(clusters::overlap({1, 2, 3}, {2, 3, 4}) == 0.5);
  CHECK(clusters::overlap({1, 2}, {3}) == 0.0);
  CHECK(clusters::overlap({5}, {5}) == 1.0);
  CHECK(clusters::overlap({}, {5}) == 0.0);
  CHECK(clusters::overlap({}, {}) == 1.0);
}

TEST_CASE("neighbours are the nearest and who is as near as the last of them") {
  std::vector<Vector2d> places = random_places(80, 5);
  for (int j = 0; j < 6; ++j) {
    for (int i = 0; i < 6; ++i) places.emplace_back(100.0 + i, 100.0 + j);  // many are as near
  }
  std::set<clusters::Neighbours> expected;
  for (std::uint32_t a = 0; a < places.size(); ++a) {
    std::vector<double> squared;
    for (const Vector2d& p : places) squared.push_back((p - places[a]).squaredNorm());
    std::vector<double> sorted = squared;
    std::sort(sorted.begin(), sorted.end());
    for (std::uint32_t b = 0; b < places.size(); ++b) {
      if (b != a && squared[b] <= sorted[8]) expected.insert(std::minmax(a, b));
    }
  }
  const auto got = clusters::neighbours_of(places, 8);
  CHECK(std::vector(expected.begin(), expected.end()) == got);
  CHECK(clusters::neighbours_of(std::vector<Vector2d>{{1, 1}}, 8).empty());
  CHECK(clusters::neighbours_of(std::vector<Vector2d>{{1, 1}, {1, 1}, {2, 2}}, 8).size() == 3);
}

TEST_CASE("viewpoints above one another are neighbours of all viewpoints of the nearest places") {
  std::vector<Vector2d> places = random_places(50, 7);
  for (int i = 0; i < 5; ++i) places.emplace_back(100.0 + i, 100.0);  // many are as near
  constexpr std::uint32_t kHeights = 9;
  std::vector<Vector2d> viewpoints;
  for (std::uint32_t h = 0; h < kHeights; ++h) {
    viewpoints.insert(viewpoints.end(), places.begin(), places.end());
  }
  const auto n = static_cast<std::uint32_t>(places.size());
  std::set<clusters::Neighbours> expected;
  const auto expect = [&](std::uint32_t a, std::uint32_t b) {
    for (std::uint32_t g = 0; g < kHeights; ++g) {
      for (std::uint32_t h = 0; h < kHeights; ++h) {
        if (a + g * n != b + h * n) expected.insert(std::minmax(a + g * n, b + h * n));
      }
    }
  };
  for (std::uint32_t k = 0; k < n; ++k) expect(k, k);
  for (const auto& [a, b] : clusters::neighbours_of(places, 8)) expect(a, b);
  CHECK(clusters::neighbours_of(viewpoints, 8) == std::vector(expected.begin(), expected.end()));
}

TEST_CASE("viewpoints at several heights make the regions of one height") {
  const PointCloud map = floor(0, 40, 0, 10);
  Told survey = two_rooms(map);
  const auto one_height = made("min_overlap = 0.5", map, survey).regions();
  const PointCloud places = survey.places;
  for (int height = 1; height < 9; ++height) {
    for (const Point& place : places) survey.places.push_back(place + Point(0, 0, 0.2 * height));
  }
  CHECK(made("min_overlap = 0.5", map, survey).regions() == one_height);
}

TEST_CASE("groups are those of the definition") {
  for (unsigned seed = 0; seed < 12; ++seed) {
    CAPTURE(seed);
    const auto places = random_places(60, seed);
    const auto seen = random_sets(60, seed + 100);
    const auto neighbours = clusters::neighbours_of(places, 4);
    const clusters::GroupLimits limits{.min_overlap = 0.15 + 0.02 * seed,
                                       .max_width = seed % 2 == 0 ? kInfinity : 20.0};
    const auto slow = group_slowly(places, seen, neighbours, limits);
    const clusters::Groups fast = clusters::group(places, seen, neighbours, limits);
    const std::set<std::uint32_t> lowest(slow.begin(), slow.end());
    CHECK(fast.count == lowest.size());
    CHECK(fast.count < 60);
    CHECK(fast.count > 1);
    for (std::size_t k = 0; k < slow.size(); ++k) {
      CHECK(fast.of_viewpoint[k] == std::distance(lowest.begin(), lowest.find(slow[k])));
    }
  }
}

TEST_CASE("two rooms are two regions") {
  const PointCloud map = floor(0, 40, 0, 10);
  const Partition partition = made("min_overlap = 0.5", map, two_rooms(map));
  REQUIRE(partition.size() == 2);
  CHECK(partition.regions()[0] == Region{"group_000", HalfOpenBox{{0, 0}, {20, 10}}, {}});
  CHECK(partition.regions()[1] == Region{"group_001", HalfOpenBox{{20, 0}, {40, 10}}, {}});
}

TEST_CASE("rooms that see enough of each other are one region") {
  const PointCloud map = floor(0, 40, 0, 10);
  Told survey = two_rooms(map);
  // From each room, everything within 12 m of the wall is seen: 320 of 320 + 2 * 80 points.
  survey.sees = [](const Point& from, const Point& p) {
    return from.x() < 20 ? p.x() < 32 : p.x() > 8;
  };
  // 24 of 40 m: 0.6.
  CHECK(made("min_overlap = 0.55", map, survey).size() == 1);
  CHECK(made("min_overlap = 0.65", map, survey).size() == 2);
}

TEST_CASE("a lower min_overlap makes fewer regions, max_width keeps them narrow") {
  const PointCloud map = floor(0, 120, 0, 6);
  const conformance::RangeSurvey survey(map, 12.0);
  std::size_t before = 1000;
  for (const std::string overlap : {"0.9", "0.6", "0.4", "0.2", "0.05"}) {
    const std::size_t regions = made("min_overlap = " + overlap, map, survey).size();
    CHECK(regions <= before);
    before = regions;
  }
  CHECK(before < 6);
  const Partition narrow = made("min_overlap = 0.05\nmax_width = 11.0", map, survey);
  CHECK(narrow.size() >= 10);
  for (const Region& region : narrow.regions()) {
    const auto& box = std::get<HalfOpenBox>(region.footprint);
    CHECK(box.max.x() - box.min.x() <= 12.0);
  }
}

TEST_CASE("places near a viewpoint are owned though the map shows nothing there") {
  PointCloud map = floor(0, 10, 0, 2);
  for (const Point& p : floor(0, 10, 18, 20)) map.push_back(p);
  const conformance::RangeSurvey survey(map, 8.0);
  const Partition by_default = made("min_overlap = 0.1", map, survey);
  CHECK(by_default.locate(Vector2d(5, 4.5)));
  CHECK(!by_default.locate(Vector2d(5, 9)));
  CHECK(!made("min_overlap = 0.1\nfill_radius = 0.0", map, survey).locate(Vector2d(5, 4.5)));
}

TEST_CASE("every map point is located, also on edges and far from the origin; no region is empty") {
  for (const double offset : {0.0, -0.05, 1e6, -5e6}) {
    CAPTURE(offset);
    const PointCloud map = test::lattice(40, 0.3, offset);
    for (const std::string cell : {"0.3", "1.0", "7.0"}) {
      CAPTURE(cell);
      const Partition partition = made("min_overlap = 0.6\nvoxel_size = 0.5\ncell_size = " + cell,
                                       map, conformance::RangeSurvey(map, 4.0));
      test::check_every_region_owns(partition, map);
    }
  }
}

TEST_CASE("neither the order of points and viewpoints nor the number of threads matters") {
  PointCloud map = floor(0, 60, 0, 20);
  const std::string params = "min_overlap = 0.4\nvoxel_size = 1.5";
  const auto near = [](const Point& from, const Point& p) { return (from - p).norm() < 9.0; };
  Told survey;
  survey.map = map;
  survey.places = viewpoints_over_floor(0, 60, 0, 20);
  survey.sees = near;
  const auto before = made(params, map, survey).regions();
  CHECK(before.size() > 2);
  {
    const tbb::global_control one(tbb::global_control::max_allowed_parallelism, 1);
    CHECK(made(params, map, survey).regions() == before);
  }
  std::mt19937 random(12);
  std::shuffle(map.begin(), map.end(), random);
  std::shuffle(survey.places.begin(), survey.places.end(), random);
  // A mean of points that is summed in another order differs in its last bits.
  for (Point& q : survey.places) q.x() = std::nextafter(q.x(), random() % 2 == 0 ? 0.0 : 1e9);
  CHECK(made(params, map, survey).regions() == before);
}

TEST_CASE("small maps have regions: one point, equal points, a line, nothing seen") {
  const auto regions = [](const PointCloud& map, double range) {
    return made("min_overlap = 0.5", map, conformance::RangeSurvey(map, range)).size();
  };
  CHECK(regions({{7, 3, 1}}, 15.0) == 1);
  CHECK(regions(PointCloud(50, Point(7, 3, 1)), 15.0) == 1);
  CHECK(regions({{0, 0, 0}, {1, 0, 0}, {2, 0, 0}, {3, 0, 0}}, 15.0) == 1);
  CHECK(regions({{0, 0, 0}, {1, 0, 0}, {2, 0, 0}, {3, 0, 0}}, 0.1) == 1);
}

TEST_CASE("bad input is refused") {
  const PointCloud map = floor(0, 10, 0, 10);
  const auto refused = [](const std::string& params, const PointCloud& points,
                          const MapSurvey& survey, ErrorCode code, const std::string& because) {
    const auto partition = by_sight(params)->partition(MapInMemory(points), {}, survey);
    REQUIRE(!partition);
    CHECK(partition.error().code == code);
    CHECK_MESSAGE(partition.error().message.find(because) != std::string::npos,
                  partition.error().message);
  };
  const std::string ok = "min_overlap = 0.5";
  const conformance::RangeSurvey survey(map, 5.0);
  refused(ok, {}, survey, ErrorCode::invalid_input, "no points");
  refused(ok, {{0, kInfinity, 0}}, survey, ErrorCode::invalid_input, "not finite");
  refused(ok + "\ncell_size = 1e-9", map, survey, ErrorCode::invalid_input, "cell_size = 1e-09 m");
  refused(ok + "\nvoxel_size = 1e-300", map, survey, ErrorCode::invalid_input,
          "voxel_size = 1e-300 m");
  Told none;
  none.map = map;
  refused(ok, map, none, ErrorCode::invalid_input, "this map has none");
  Told blind;
  blind.map = map;
  blind.places = {{3, 4, 1}, {1, 2, 1}, {7, 2, 1}};
  refused(ok, map, blind, ErrorCode::internal, "blind at 1");  // the first by y, then x
  blind.places = {{3, kInfinity, 1}};
  refused(ok, map, blind, ErrorCode::invalid_input, "viewpoints");
}

TEST_CASE("bad parameters are refused") {
  for (const std::string params :
       {"", "min_overlap = 0.0", "min_overlap = 1.0", "min_overlap = nan",
        "min_overlap = 0.5\nvoxel_size = 0.0", "min_overlap = 0.5\ncell_size = -1.0",
        "min_overlap = 0.5\nmax_width = 0.0", "min_overlap = 0.5\nfill_radius = -1.0",
        "min_overlp = 0.5"}) {
    CAPTURE(params);
    CHECK_THROWS((void)by_sight(params));
  }
}

}  // namespace
}  // namespace vantage
