#include "vantage/build/thinning.hpp"
#include "vantage/kit/voxel_sizes.hpp"

#include <doctest/doctest.h>
#include <tbb/global_control.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <map>
#include <numeric>
#include <random>
#include <set>

#include "vantage/engine/config.hpp"

using namespace vantage;

namespace {

PointCloud scattered(std::size_t count, const Point& low, const Point& high) {
  std::mt19937 random(7);
  const auto uniform = [&] { return static_cast<double>(random()) / 4294967296.0; };
  PointCloud points;
  for (std::size_t i = 0; i < count; ++i) {
    const Point share(uniform(), uniform(), uniform());
    points.push_back(low + share.cwiseProduct(high - low));
  }
  return points;
}

IndexList all_of(PointsView map) {
  IndexList all(map.size());
  std::iota(all.begin(), all.end(), 0U);
  return all;
}

std::array<double, 3> voxel_of(const Point& p, double size) {
  return {std::floor(p.x() / size), std::floor(p.y() / size), std::floor(p.z() / size)};
}

std::size_t voxels(PointsView map, const IndexList& indices, double size) {
  std::set<std::array<double, 3>> seen;
  for (const std::uint32_t k : indices) seen.insert(voxel_of(map[k], size));
  return seen.size();
}

ThinningParams voxels_of_size(double size) { return {.voxel_size = size, .budget = {}}; }
ThinningParams budget_of(std::uint32_t points) { return {.voxel_size = {}, .budget = points}; }

bool less(const Point& a, const Point& b) {
  return std::lexicographical_compare(a.begin(), a.end(), b.begin(), b.end());
}

}  // namespace

TEST_CASE("of each voxel the point nearest to the mean of its points stays") {
  // Around the origin: negative coordinates round down too.
  const PointCloud map = scattered(3000, {-4, -4, -1}, {4, 4, 1});
  IndexList candidates;
  for (std::uint32_t k = 0; k < map.size(); k += 2) candidates.push_back(k);
  const IndexList chosen = thinned(map, candidates, voxels_of_size(0.7));
  CHECK(std::is_sorted(chosen.begin(), chosen.end(), std::less_equal<>()));
  CHECK(std::includes(candidates.begin(), candidates.end(), chosen.begin(), chosen.end()));
  CHECK(chosen.size() == voxels(map, candidates, 0.7));
  CHECK(chosen.size() == voxels(map, chosen, 0.7));

  std::map<std::array<double, 3>, IndexList> members;
  for (const std::uint32_t k : candidates) members[voxel_of(map[k], 0.7)].push_back(k);
  for (const std::uint32_t k : chosen) {
    const IndexList& others = members[voxel_of(map[k], 0.7)];
    Point mean = Point::Zero();
    for (const std::uint32_t other : others) mean += map[other];
    mean /= static_cast<double>(others.size());
    for (const std::uint32_t other : others) {
      CHECK((map[k] - mean).norm() <= (map[other] - mean).norm() + 1e-12);
    }
  }
}

TEST_CASE("of equally near points the first by its coordinates stays, whatever their order") {
  const PointCloud map{{0.75, 0.5, 0.5}, {0.25, 0.5, 0.5}, {0.5, 0.75, 0.5}, {0.5, 0.25, 0.5}};
  IndexList order = all_of(map);
  do {
    PointCloud turned;
    for (const std::uint32_t k : order) turned.push_back(map[k]);
    const IndexList chosen = thinned(turned, all_of(turned), voxels_of_size(1.0));
    REQUIRE(chosen.size() == 1);
    CHECK(turned[chosen.front()] == map[1]);
  } while (std::next_permutation(order.begin(), order.end()));
}

TEST_CASE("thinning depends on the points alone, not on their order or the number of threads") {
  const PointCloud map = scattered(20'000, {1e6, 5e6, 300}, {1e6 + 30, 5e6 + 20, 305});
  for (const ThinningParams& params : {voxels_of_size(0.9), budget_of(1000)}) {
    std::vector<PointCloud> results;
    PointCloud turned = map;
    for (const std::size_t threads : {1U, 2U, 4U}) {
      const tbb::global_control limit(tbb::global_control::max_allowed_parallelism, threads);
      PointCloud& kept = results.emplace_back();
      for (const std::uint32_t k : thinned(turned, all_of(turned), params)) {
        kept.push_back(turned[k]);
      }
      std::sort(kept.begin(), kept.end(), less);
      std::shuffle(turned.begin(), turned.end(), std::mt19937(5));
    }
    CHECK(results[0].size() > 500);
    CHECK(results[0] == results[1]);
    CHECK(results[0] == results[2]);
  }
}

TEST_CASE("neighbouring regions share voxels: each keeps what is alone in a voxel of both") {
  const PointCloud map = scattered(2000, {0, 0, 0}, {10, 10, 1});
  IndexList left, right;  // cut where voxels are
  for (std::uint32_t k = 0; k < map.size(); ++k) (map[k].x() < 5.0 ? left : right).push_back(k);
  IndexList both = thinned(map, left, voxels_of_size(0.5));
  const IndexList of_right = thinned(map, right, voxels_of_size(0.5));
  both.insert(both.end(), of_right.begin(), of_right.end());
  std::sort(both.begin(), both.end());
  CHECK(both == thinned(map, all_of(map), voxels_of_size(0.5)));
}

TEST_CASE("a budget takes the smallest voxels that leave no more points") {
  const PointCloud map = scattered(20'000, {-10, -10, 0}, {10, 10, 3});
  const IndexList all = all_of(map);
  for (const std::uint32_t budget : {8U, 9U, 100U, 3000U, 19'999U}) {
    CAPTURE(budget);
    const IndexList chosen = thinned(map, all, budget_of(budget));
    CHECK(chosen.size() <= budget);
    const VoxelSizes sizes = voxel_sizes_around(map, all, budget + 1);
    CHECK(sizes.enough < sizes.few);
    CHECK(sizes.few <= 1.015 * sizes.enough);
    CHECK(voxels(map, all, sizes.enough) > budget);
    CHECK(chosen.size() == voxels(map, all, sizes.few));
    CHECK(chosen == thinned(map, all, voxels_of_size(sizes.few)));
  }
  CHECK(thinned(map, all, budget_of(3000)).size() > 2900);
  CHECK(thinned(map, all, budget_of(20'000)) == all);
}

TEST_CASE("a budget is kept by points at few places, and by points millions of metres apart") {
  PointCloud equal(1000, Point(1, 2, 3));
  CHECK(thinned(equal, all_of(equal), budget_of(8)).size() == 1);
  equal.push_back({1, 2, 3 + 1e-9});
  CHECK(thinned(equal, all_of(equal), budget_of(8)).size() <= 2);
  const PointCloud apart = scattered(1000, {-1e7, -1e7, -1e7}, {1e7, 1e7, 1e7});
  CHECK(thinned(apart, all_of(apart), budget_of(8)).size() <= 8);
  const PointCloud east = scattered(1000, {4e6, 5e6, 0}, {6e6, 5e6 + 1, 1});
  CHECK(thinned(east, all_of(east), budget_of(8)).size() <= 8);
  CHECK(thinned({}, {}, budget_of(8)).empty());
  CHECK(thinned({}, {}, voxels_of_size(1.0)).empty());
}

TEST_CASE("[thinning] takes one of its two keys") {
  const auto parsed = [](const std::string& text) {
    return parse<ThinningParams>(parse_toml(text, "test").value());
  };
  CHECK(parsed("voxel_size = 0.25").value().voxel_size == 0.25);
  CHECK(parsed("budget = 100000").value().budget == 100'000);
  CHECK(parsed("").error().message == "thinning needs 'voxel_size' or 'budget'");
  CHECK(parsed("voxel_size = 0.25\nbudget = 100").error().message ==
        "'voxel_size' and 'budget' both set the amount of thinning; give only one of them");
  CHECK_FALSE(parsed("budget = 7"));
  CHECK_FALSE(parsed("voxel_size = 0.0"));
}
