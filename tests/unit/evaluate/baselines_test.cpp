#include "vantage/evaluation/baselines.hpp"

#include <doctest/doctest.h>

#include <algorithm>
#include <cmath>
#include <numeric>
#include <random>
#include <set>

#include "support/bundles.hpp"
#include "support/plugins.hpp"
#include "support/real_data.hpp"
#include "vantage/engine/atlas.hpp"

using namespace vantage;

namespace {

/// A floor, dense on the left (x < 0) and ten times thinner on the right.
PointCloud uneven_floor() {
  std::mt19937 random(3);
  const auto uniform = [&] { return static_cast<double>(random()) / 4294967296.0; };
  PointCloud map;
  for (int i = 0; i < 10'000; ++i) map.push_back({-10 * uniform(), 10 * uniform(), uniform()});
  for (int i = 0; i < 1'000; ++i) map.push_back({10 * uniform(), 10 * uniform(), uniform()});
  return map;
}

IndexList all_of(PointsView map) {
  IndexList all(map.size());
  std::iota(all.begin(), all.end(), 0U);
  return all;
}

bool ascends_strictly(const IndexList& indices) {
  return std::adjacent_find(indices.begin(), indices.end(), std::greater_equal<>()) ==
         indices.end();
}

/// The candidates with their distances, one by one.
Reach reach_from(PointsView map, const IndexList& candidates, PointsView viewpoints) {
  Reach reach{.indices = candidates, .squared = {}};
  for (const std::uint32_t i : candidates) {
    double least = 1e300;
    for (const Point& v : viewpoints) least = std::min(least, (map[i] - v).squaredNorm());
    reach.squared.push_back(least);
  }
  return reach;
}

double share_on_the_left(PointsView map, const IndexList& indices) {
  const auto left = std::count_if(indices.begin(), indices.end(),
                                  [&](std::uint32_t i) { return map[i].x() < 0; });
  return static_cast<double>(left) / static_cast<double>(indices.size());
}

std::multiset<double> xs_of(PointsView map, const IndexList& indices) {
  std::multiset<double> xs;
  for (const std::uint32_t i : indices) xs.insert(map[i].x());
  return xs;
}

}  // namespace

TEST_CASE("every thinning gives exactly as many points as asked for, all of them candidates") {
  const PointCloud map = uneven_floor();
  IndexList candidates;
  for (std::uint32_t i = 0; i < map.size(); i += 2) candidates.push_back(i);
  const PointCloud viewpoints{{0, 5, 1}};
  for (const std::size_t count : {std::size_t{1}, std::size_t{7}, std::size_t{500},
                                  std::size_t{5499}, std::size_t{5500}, std::size_t{9000}}) {
    CAPTURE(count);
    for (const IndexList& chosen :
         {random_thinning(map, candidates, count), voxel_thinning(map, candidates, count),
          radius_crop(reach_from(map, candidates, viewpoints), count)}) {
      CHECK(chosen.size() == std::min(count, candidates.size()));
      CHECK(ascends_strictly(chosen));
      CHECK(std::includes(candidates.begin(), candidates.end(), chosen.begin(), chosen.end()));
    }
  }
}

TEST_CASE("random thinning keeps the density's unevenness, voxel thinning levels it") {
  const PointCloud map = uneven_floor();
  const IndexList all = all_of(map);
  CHECK(share_on_the_left(map, all) == doctest::Approx(10.0 / 11.0));
  CHECK(share_on_the_left(map, random_thinning(map, all, 800)) ==
        doctest::Approx(10.0 / 11.0).epsilon(0.03));
  CHECK(share_on_the_left(map, voxel_thinning(map, all, 800)) ==
        doctest::Approx(0.55).epsilon(0.12));
}

TEST_CASE("voxel thinning leaves no two points close together") {
  const PointCloud map = uneven_floor();
  const IndexList chosen = voxel_thinning(map, all_of(map), 800);
  const IndexList random = random_thinning(map, all_of(map), 800);
  const auto close_pairs = [&](const IndexList& indices) {
    int pairs = 0;
    for (std::size_t i = 0; i < indices.size(); ++i) {
      for (std::size_t j = i + 1; j < indices.size(); ++j) {
        pairs += (map[indices[i]] - map[indices[j]]).norm() < 0.2 ? 1 : 0;
      }
    }
    return pairs;
  };
  CHECK(close_pairs(chosen) < close_pairs(random) / 2);
}

TEST_CASE("the radius crop takes what is nearest to any viewpoint") {
  const PointCloud map = uneven_floor();
  const IndexList all = all_of(map);
  const PointCloud viewpoints{{-8, 2, 1}, {8, 8, 1}};
  const IndexList chosen = radius_crop(reach_from(map, all, viewpoints), 400);
  const auto distance = [&](std::uint32_t i) {
    return std::min((map[i] - viewpoints[0]).norm(), (map[i] - viewpoints[1]).norm());
  };
  double farthest = 0.0;
  for (const std::uint32_t i : chosen) farthest = std::max(farthest, distance(i));
  for (const std::uint32_t i : all) {
    if (!std::binary_search(chosen.begin(), chosen.end(), i)) CHECK(distance(i) >= farthest);
  }
}

TEST_CASE("thinnings depend on the points, not on their order") {
  const PointCloud map = uneven_floor();
  PointCloud turned(map.rbegin(), map.rend());
  const IndexList all = all_of(map);
  CHECK(xs_of(map, random_thinning(map, all, 300)) ==
        xs_of(turned, random_thinning(turned, all, 300)));
  CHECK(xs_of(map, voxel_thinning(map, all, 300)) ==
        xs_of(turned, voxel_thinning(turned, all, 300)));
}

TEST_CASE("baselines have the index of places of their original, and not its atlas") {
  const test::TemporaryFolder folder;
  const auto store =
      test::plugin<MapStore>("pcd_tiles", "root = \"" + (folder.path() / "bundle").string() + "\"");
  MapIndex index;
  index.partition = Partition::from({{"all", HalfOpenBox{{0, 0}, {1, 1}}, {}}}).value();
  auto writer = test::begun(store, index);
  const std::vector<std::byte> places(3, std::byte{7}), atlas(4, std::byte{8});
  REQUIRE(writer->attach("places", places));
  REQUIRE(writer->attach(Atlas::kAttachment, atlas));
  test::finish(std::move(writer),
               {{.points = {{0.5, 0.5, 0.5}}, .viewpoints = {}, .prepared = {}}});
  const auto original = test::opened(store);

  const PointCloud map{{0.5, 0.5, 0.5}};
  const BaselineMaps maps(*original, original->index().value(), map, VisibilityConfig{});
  const BaselineReader baseline(maps, Thinning::random);
  CHECK(baseline.attachment("places").value() == places);
  CHECK(baseline.attachment(Atlas::kAttachment).error().code == ErrorCode::not_found);
}

TEST_CASE("voxel thinning copes with many points at one place") {
  PointCloud map(1000, Point(1, 2, 3));
  map.push_back({5, 5, 5});
  CHECK(voxel_thinning(map, all_of(map), 10).size() == 10);
}

TEST_CASE(
    "what is within reach: the range from any viewpoint, and the region where only it counts") {
  PointCloud map;
  for (int i = 0; i < 100; ++i) map.push_back({0.5 + i, 0.5, 0.0});
  const auto partition = Partition::from({Region{"left", HalfOpenBox{{0, 0}, {50, 1}}, {}},
                                          Region{"right", HalfOpenBox{{50, 0}, {101, 1}}, {}}});
  REQUIRE_MESSAGE(partition, partition.error().message);
  VisibilityConfig visibility;
  visibility.max_range = 10.0;
  const PointCloud viewpoints{{45.5, 0.5, 0.0}, {49.5, 0.5, 0.0}};
  Reach reach = reach_of(map, viewpoints, visibility, *partition, RegionId{0});
  CHECK(reach.indices.front() == 35);
  CHECK(reach.indices.back() == 59);
  CHECK(reach.indices.size() == 25);
  CHECK(reach.squared.front() == doctest::Approx(100.0));
  CHECK(reach.squared == reach_from(map, reach.indices, viewpoints).squared);
  visibility.scope = VisibilityScope::region;
  reach = reach_of(map, viewpoints, visibility, *partition, RegionId{0});
  CHECK(reach.indices.front() == 35);
  CHECK(reach.indices.back() == 49);
  CHECK(reach_of(map, {}, visibility, *partition, RegionId{0}).indices.empty());
  visibility = {};
  CHECK(reach_of(map, viewpoints, visibility, *partition, RegionId{0}).indices.size() == 100);
}
