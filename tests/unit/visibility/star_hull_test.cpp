// The hull that proves every decision: it says so where it cannot.
#include <doctest/doctest.h>

#include <Eigen/Geometry>
#include <algorithm>

#include "direction_bins.hpp"
#include "scenes.hpp"
#include "star_hull.hpp"

namespace vantage::test {
namespace {

using hpr::StarHull;
using Verdict = StarHull::Verdict;

StarHull unit_tetrahedron() {
  return StarHull::from({1, 0, 0}, {0, 1, 0}, {0, 0, 1}, 10.0, 8).value();
}

TEST_CASE("StarHull inserts, refuses and buries points") {
  StarHull hull = unit_tetrahedron();
  CHECK(hull.vertices() == std::vector<std::uint32_t>{1, 2, 3});
  CHECK(hull.insert({0.2, 0.2, 0.2}).verdict == Verdict::inside);
  CHECK(hull.insert({0, 1, 0}).verdict == Verdict::coincident);
  CHECK(hull.insert({0, 1, 0}).vertex == 2);
  CHECK(hull.insert({0.5, 0.25, 0.25}).verdict == Verdict::undecided);  // on a facet
  CHECK(hull.insert({0.5, 0.5, 0.0}).verdict == Verdict::undecided);    // on an edge
  CHECK(hull.insert({2, 0, 0}).verdict == Verdict::undecided);          // in the plane of a facet
  CHECK(hull.vertices() == std::vector<std::uint32_t>{1, 2, 3});
  CHECK(hull.insert({1, 1, 1.5}).verdict == Verdict::inserted);
  CHECK(hull.insert({-0.5, -0.5, 3}).verdict == Verdict::inserted);
  const auto buries = hull.insert({4, 5, 6});
  CHECK(buries.verdict == Verdict::inserted);
  CHECK(buries.vertex == 6);
  CHECK(hull.vertices() == std::vector<std::uint32_t>{1, 2, 5, 6});
  CHECK(hull.insert({1, 1, 1.5}).verdict == Verdict::inside);
}

TEST_CASE("StarHull refuses a first tetrahedron without a certain volume") {
  CHECK(!StarHull::from({1, 0, 0}, {0, 1, 0}, {1, 1, 0}, 10.0, 8));
  CHECK(!StarHull::from({1, 0, 0}, {2, 0, 0}, {0, 0, 1}, 10.0, 8));
  CHECK(StarHull::from({1, 0, 0}, {0, 0, 1}, {0, 1, 0}, 10.0, 8));
}

TEST_CASE("StarHull::reach never overestimates and is tight") {
  StarHull hull = unit_tetrahedron();
  for (const Point& p : ball(1, 500, 5.0, 1.0)) (void)hull.insert(p);
  std::size_t reached = 0;
  for (const Point& p : sphere(500, 1.0)) {
    const Eigen::Vector3d u = p.normalized();
    const double reach = hull.reach(u);
    if (reach == 0.0) continue;
    ++reached;
    StarHull inner = hull, outer = hull;
    CHECK(inner.insert((1.0 - 1e-9) * reach * u).verdict == Verdict::inside);
    CHECK(outer.insert((1.0 + 1e-9) * reach * u).verdict == Verdict::inserted);
  }
  CHECK(reached > 450);
}

TEST_CASE("StarHull::holds_ball") {
  StarHull hull = unit_tetrahedron();
  const Point centre(0.2, 0.2, 0.2);
  CHECK(hull.holds_ball(centre, 0.19));
  CHECK(!hull.holds_ball(centre, 0.21));  // 0.2 from three of the planes
  CHECK(!hull.holds_ball({0.33, 0.33, 0.33}, 0.01));
  CHECK(!hull.holds_ball({1, 1, 1}, 0.01));
  CHECK(!hull.holds_ball({-1, -1, -1}, 0.01));
}

TEST_CASE("a direction lies in the cone of its bin's corners") {
  for (const std::size_t points : {1U, 100'000U, 2'000'000U}) {
    const auto bins = hpr::DirectionBins::for_points(points);
    for (const Point& p : ball(9, 5000, 3.0)) {
      const std::uint32_t bin = hpr::number_of(bins.bin_of(p));
      REQUIRE(bin < bins.size());
      CHECK(bins.coarser_bin(bin, 4) < bins.coarser(4).size());
      const auto corners = bins.corners_of(bin);
      const auto corner = [&](std::size_t i) { return bins.direction_of_corner(corners[i]); };
      const Eigen::Vector3d centre = corner(0) + corner(1) + corner(2) + corner(3);
      const std::size_t around[] = {0, 1, 3, 2, 0};
      for (std::size_t i = 0; i < 4; ++i) {
        const Eigen::Vector3d side = corner(around[i]).cross(corner(around[i + 1]));
        CHECK(side.dot(p) * side.dot(centre) >= -1e-12);
      }
    }
  }
}

}  // namespace
}  // namespace vantage::test
