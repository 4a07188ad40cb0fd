// The hull that proves every decision: it says so where it cannot.
#include <doctest/doctest.h>

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
  for (const Point& p : ball(9, 5000, 3.0)) {
    const hpr::BinId id = hpr::bin_of(p);
    const auto corners = hpr::corners_of(hpr::number_of(id));
    Eigen::Vector3d centre = Eigen::Vector3d::Zero();
    for (const std::uint32_t corner : corners) centre += 0.25 * hpr::direction_of_corner(corner);
    double widest = 1.0;
    for (const std::uint32_t corner : corners) {
      widest = std::min(widest, hpr::direction_of_corner(corner).dot(centre.normalized()));
    }
    CHECK(p.normalized().dot(centre.normalized()) >= widest - 1e-12);
  }
}

}  // namespace
}  // namespace vantage::test
