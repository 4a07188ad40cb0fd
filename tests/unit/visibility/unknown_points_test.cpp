#include <doctest/doctest.h>

#include <algorithm>
#include <numeric>
#include <random>
#include <thread>
#include <vector>

#include "point_octree.hpp"
#include "scenes.hpp"
#include "unknown_points.hpp"

namespace vantage::test {
namespace {

using hpr::PointOctree, hpr::UnknownPoints;
using Index = PointOctree::Index;

std::vector<Index> leaf_of_each(const PointOctree& octree) {
  std::vector<Index> leaves(octree.points().size());
  for (Index n = 0; n < octree.nodes().size(); ++n) {
    const auto& node = octree.nodes()[n];
    if (node.is_leaf()) std::fill(leaves.begin() + node.first, leaves.begin() + node.last, n);
  }
  return leaves;
}

// Nodes of which `any_in` does not say what `holds` says of their points.
std::size_t wrong_nodes(const PointOctree& octree, const UnknownPoints& unknown) {
  std::size_t wrong = 0;
  for (Index n = 0; n < octree.nodes().size(); ++n) {
    bool any = false;
    for (Index k = octree.nodes()[n].first; k < octree.nodes()[n].last; ++k) {
      any = any || unknown.holds(k);
    }
    if (unknown.any_in(n) != any) ++wrong;
  }
  return wrong;
}

TEST_CASE("UnknownPoints: a marked point is seen, and counted once at every node above it") {
  const PointCloud map = joined(ball(1, 1000, 10.0), PointCloud(50, Point(1, 2, 3)));
  const PointOctree octree(map);
  const auto leaves = leaf_of_each(octree);
  UnknownPoints unknown(octree);
  CHECK(unknown.seen().empty());
  CHECK(wrong_nodes(octree, unknown) == 0);

  std::vector<Index> order(map.size()), seen;
  std::iota(order.begin(), order.end(), Index{0});
  std::shuffle(order.begin(), order.end(), std::mt19937(2));
  for (std::size_t i = 0; i < order.size(); ++i) {
    CHECK(unknown.holds(order[i]));
    for (int again = 0; again < 3; ++again) unknown.mark_seen(order[i], leaves[order[i]]);
    CHECK(!unknown.holds(order[i]));
    seen.insert(std::lower_bound(seen.begin(), seen.end(), order[i]), order[i]);
    if (i % 100 != 0 && i + 2 < order.size()) continue;
    CHECK(unknown.seen() == seen);
    CHECK(wrong_nodes(octree, unknown) == 0);
  }
  CHECK(!unknown.any_in(0));
}

TEST_CASE("UnknownPoints: a map of one word of points, less one, and one more") {
  for (const std::size_t size : {1U, 63U, 64U, 65U, 128U}) {
    const PointOctree octree(ball(3, size, 10.0));
    const auto leaves = leaf_of_each(octree);
    UnknownPoints unknown(octree);
    const auto last = static_cast<Index>(size - 1);
    unknown.mark_seen(last, leaves[last]);
    CHECK(unknown.seen() == std::vector<Index>{last});
    CHECK(unknown.any_in(0) == (size > 1));
  }
}

TEST_CASE("UnknownPoints: threads that mark the same points count each once") {
  const PointOctree octree(ball(4, 20'000, 10.0));
  const auto leaves = leaf_of_each(octree);
  UnknownPoints unknown(octree);
  const auto mark = [&](std::uint32_t seed) {
    std::vector<Index> order;
    for (Index k = 0; k < leaves.size(); ++k) {
      if (k % 7 != 0) order.push_back(k);
    }
    std::shuffle(order.begin(), order.end(), std::mt19937(seed));
    for (const Index k : order) unknown.mark_seen(k, leaves[k]);
  };
  {
    std::vector<std::jthread> threads;
    for (std::uint32_t seed = 0; seed < 4; ++seed) threads.emplace_back(mark, seed);
  }
  CHECK(wrong_nodes(octree, unknown) == 0);
  for (Index k = 0; k < leaves.size(); ++k) REQUIRE(unknown.holds(k) == (k % 7 == 0));
  for (Index k = 0; k < leaves.size(); k += 7) unknown.mark_seen(k, leaves[k]);
  CHECK(wrong_nodes(octree, unknown) == 0);
  CHECK(!unknown.any_in(0));
}

}  // namespace
}  // namespace vantage::test
