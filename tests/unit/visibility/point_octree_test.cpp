// The octree over the map: what the search relies on.
#include <doctest/doctest.h>

#include <algorithm>
#include <cstdint>
#include <limits>
#include <numeric>
#include <random>
#include <vector>

#include "point_octree.hpp"
#include "scenes.hpp"

namespace vantage::test {
namespace {

using hpr::PointOctree;
using Index = PointOctree::Index;

// p from the origin, in double.
bool holds(const PointOctree& octree, const PointOctree::Node& node, const Point& p) {
  const Point from_origin = p - octree.origin();
  return (from_origin.array() >= node.min.cast<double>().array()).all() &&
         (from_origin.array() <= node.max.cast<double>().array()).all();
}

// Every clause of the header; returns the largest leaf's size.
Index check(const PointCloud& map, double rounding = 0.0) {
  const PointOctree octree(map);
  const auto nodes = octree.nodes();
  REQUIRE(!nodes.empty());
  REQUIRE(octree.points().size() == map.size());

  std::vector<int> times(map.size(), 0);
  std::size_t other_points = 0;
  for (Index k = 0; k < map.size(); ++k) {
    const Index at = octree.map_index(k);
    REQUIRE(at < map.size());
    ++times[at];
    if (octree.points()[k] != map[at]) ++other_points;
  }
  CHECK(other_points == 0);
  CHECK(std::count(times.begin(), times.end(), 1) == static_cast<std::ptrdiff_t>(map.size()));

  CHECK(nodes[0].first == 0);
  CHECK(nodes[0].last == map.size());
  CHECK(nodes[0].parent == PointOctree::kNone);
  std::size_t wrong_parents = 0, gaps = 0, many_children = 0, loose_boxes = 0, outside = 0;
  std::vector<int> reached(nodes.size(), 0);
  reached[0] = 1;
  Index largest = 0, in_leaves = 0;
  for (Index n = 0; n < nodes.size(); ++n) {
    const PointOctree::Node& node = nodes[n];
    REQUIRE(node.size() > 0);
    const Bounds3 tight = bounds_of(octree.points().subspan(node.first, node.size()));
    for (Index k = node.first; k < node.last; ++k) {
      if (!holds(octree, node, octree.points()[k])) ++outside;
    }
    const Eigen::Vector3d low = node.min.cast<double>() + octree.origin() - tight.min;
    const Eigen::Vector3d high = node.max.cast<double>() + octree.origin() - tight.max;
    const double extent = (bounds_of(map).max - bounds_of(map).min).maxCoeff();
    if (std::max(low.cwiseAbs().maxCoeff(), high.cwiseAbs().maxCoeff()) >
        1e-6 * extent + rounding) {
      ++loose_boxes;
    }
    if (node.is_leaf()) {
      largest = std::max(largest, node.size());
      in_leaves += node.size();
      continue;
    }
    REQUIRE(node.children_last <= nodes.size());
    const Index children = node.children_last - node.children_first;
    if (children < 2 || children > 8) ++many_children;
    Index next = node.first;
    for (Index c = node.children_first; c < node.children_last; ++c) {
      ++reached[c];
      if (nodes[c].parent != n || c <= n) ++wrong_parents;
      if (nodes[c].first != next) ++gaps;
      next = nodes[c].last;
    }
    if (next != node.last) ++gaps;
  }
  CHECK(wrong_parents == 0);
  CHECK(gaps == 0);
  CHECK(many_children == 0);
  CHECK(outside == 0);
  CHECK(loose_boxes == 0);
  CHECK(in_leaves == map.size());
  CHECK(std::count(reached.begin(), reached.end(), 1) == static_cast<std::ptrdiff_t>(nodes.size()));
  return largest;
}

TEST_CASE("PointOctree: each point once, boxes that hold their points, children that partition") {
  SUBCASE("random") { CHECK(check(ball(1, 20'000, 30.0)) <= hpr::PointOctree::kLeafSize); }
  SUBCASE("lattice") { CHECK(check(lattice(10, 0.1)) <= hpr::PointOctree::kLeafSize); }
  SUBCASE("plane") { CHECK(check(wall(5.0, 40, 0.1)) <= hpr::PointOctree::kLeafSize); }
  SUBCASE("line") {
    PointCloud line;
    for (int k = 0; k < 1000; ++k) line.emplace_back(0.1 * k, 7.0, -3.0);
    CHECK(check(line) <= hpr::PointOctree::kLeafSize);
  }
  SUBCASE("clusters far apart") {
    CHECK(check(joined(ball(2, 3000, 0.01), ball(3, 3000, 0.01, 0.0, {1000, 1, 2}))) <=
          hpr::PointOctree::kLeafSize);
  }
  SUBCASE("5,000 km from the origin") {
    const Eigen::Vector3d far(5e6 + 1.0 / 3.0, -4.9e6 + 0.1, 100.7);
    CHECK(check(translated(ball(4, 20'000, 30.0), far), 2e-9) <= hpr::PointOctree::kLeafSize);
    CHECK(check(translated(ball(5, 2'000, 1e-6), far), 2e-9) > 0);
  }
  SUBCASE("from 1e-100 m to 1e100 m") {
    for (const double scale : {1e-100, 1e-20, 1e20, 1e30}) {
      PointCloud map = ball(6, 500, 1.0);
      for (Point& p : map) p *= scale;
      CHECK(check(map, 1e-44) > 0);  // a float's smallest step
    }
  }
}

TEST_CASE("PointOctree: more points at one place than a leaf is meant for") {
  CHECK(check(PointCloud(1, Point(1, 2, 3))) == 1);
  CHECK(check(PointCloud(1000, Point(1, 2, 3))) == 1000);
  CHECK(check(PointCloud(1000, Point(5e6 + 0.1, -0.3, 1e-9)), 1e-9) == 1000);
  PointCloud map = ball(7, 500, 10.0);
  map.insert(map.end(), 100, map[3]);
  map.insert(map.begin(), 100, Point(0, 0, 0));
  CHECK(check(map) >= 100);
  CHECK(check({{0, 0, 0}, {0, 0, 0}, {1, 1, 1}}) == 3);
}

TEST_CASE("PointOctree: distinct points come in an order that the map's order does not touch") {
  const PointCloud map = joined(ball(8, 5000, 20.0), lattice(5, 1.0));
  IndexList order(map.size());
  std::iota(order.begin(), order.end(), 0U);
  std::shuffle(order.begin(), order.end(), std::mt19937(9));
  const PointOctree here(map), there(select(map, order));
  CHECK(std::equal(here.points().begin(), here.points().end(), there.points().begin(),
                   there.points().end()));
  REQUIRE(here.nodes().size() == there.nodes().size());
  std::size_t differ = 0;
  for (std::size_t n = 0; n < here.nodes().size(); ++n) {
    const auto &a = here.nodes()[n], &b = there.nodes()[n];
    if (a.first != b.first || a.last != b.last || a.parent != b.parent || a.min != b.min ||
        a.max != b.max || a.children_first != b.children_first) {
      ++differ;
    }
  }
  CHECK(differ == 0);
  for (Index k = 0; k < map.size(); ++k) {
    REQUIRE(order[there.map_index(k)] == here.map_index(k));
  }
}

}  // namespace
}  // namespace vantage::test
