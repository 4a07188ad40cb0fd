// The hull that is grown point by point, against the exact judge and against its own planes.
#include <doctest/doctest.h>

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <limits>
#include <numeric>
#include <random>
#include <vector>

#include "exact_hull.hpp"
#include "hulls.hpp"
#include "scenes.hpp"
#include "star_hull.hpp"

namespace vantage::test {
namespace {

using hpr::StarHull;
using Place = StarHull::Place;
using Numbers = std::vector<std::uint32_t>;

GrownHull unit_tetrahedron() {
  return grown(std::vector<Point>{{1, 0, 0}, {0, 1, 0}, {0, 0, 1}}).value();
}

TEST_CASE("StarHull adds, refuses and buries points") {
  GrownHull g = unit_tetrahedron();
  CHECK(g.hull.vertices() == Numbers{1, 2, 3});
  CHECK(g.hull.locate({0.2, 0.2, 0.2}).place == Place::inside);
  CHECK(g.hull.locate({0, 1, 0}).place == Place::vertex);
  CHECK(g.hull.locate({0, 1, 0}).at == 2);
  CHECK(g.put_in({1, 1, 1.5}).place == Place::outside);
  CHECK(g.put_in({-0.5, -0.5, 3}).place == Place::outside);
  CHECK(g.put_in({4, 5, 6}).place == Place::outside);
  CHECK(g.hull.points() == 7);
  CHECK(g.hull.vertices() == Numbers{1, 2, 5, 6});
  CHECK(g.hull.is_on_hull(6));
  CHECK(!g.hull.is_on_hull(3));
  CHECK(!g.hull.is_on_hull(4));
  CHECK(g.put_in({1, 1, 1.5}).place == Place::inside);
}

TEST_CASE("StarHull: a point in a facet, on an edge or at a vertex is no new vertex") {
  StarHull hull = unit_tetrahedron().hull;
  const auto place = [&](const Point& p) { return hull.locate(p).place; };
  CHECK(place({0.5, 0.25, 0.25}) == Place::inside);  // in the facet across from the origin
  CHECK(place({0.5, 0.5, 0.0}) == Place::inside);    // on an edge of it
  CHECK(place({0.25, 0.25, 0.0}) == Place::inside);  // in a facet that holds the origin
  CHECK(place({0.0, 0.25, 0.0}) == Place::inside);   // on an edge that ends there
  CHECK(place({0.0, 0.0, 0.0}) == Place::inside);
  CHECK(place({0.0, 0.0, 1.0}) == Place::vertex);

  // The same beside them, by the last digit.
  constexpr double kTiny = std::numeric_limits<double>::denorm_min();
  CHECK(place({0.5, 0.25, std::nextafter(0.25, 1.0)}) == Place::outside);
  CHECK(place({0.5, 0.25, std::nextafter(0.25, 0.0)}) == Place::inside);
  CHECK(place({0.25, 0.25, -0x1p-200}) == Place::outside);
  CHECK(place({0.25, 0.25, 0x1p-200}) == Place::inside);
  CHECK(place({0.0, 0.0, std::nextafter(1.0, 2.0)}) == Place::outside);
  CHECK(place({0.0, 0.0, 1.0 - 0x1p-53}) == Place::inside);
  CHECK(place({kTiny, 0.0, 0.5}) == Place::inside);
}

TEST_CASE("StarHull: in the plane of a facet or on the line of an edge, but beyond, is outside") {
  for (const Point& p : {Point(2, 0, 0), Point(2, -1, 0), Point(1, 1, -1), Point(-1, 0, 0),
                         Point(0, -0.5, 0.5), Point(0.75, 0.75, 0), Point(-1, -1, 0)}) {
    CAPTURE(p.transpose());
    GrownHull g = unit_tetrahedron();
    CHECK(g.put_in(p).place == Place::outside);
    CHECK(g.hull.is_on_hull(4));
    CHECK(g.hull.locate(p).place == Place::vertex);
  }
}

TEST_CASE("StarHull: what a point in the same plane or line leaves between others is buried") {
  GrownHull g = unit_tetrahedron();
  g.put_in({2, 0, 0});  // (1, 0, 0) is between the origin and this
  CHECK(g.hull.vertices() == Numbers{2, 3, 4});
  g.put_in({0, 0, 0.5});
  CHECK(g.hull.vertices() == Numbers{2, 3, 4});
  g.put_in({-2, 2, 0});  // (0, 1, 0) is between this and (2, 0, 0)
  CHECK(g.hull.vertices() == Numbers{3, 4, 5});
  g.put_in({0, -2, 0});  // the origin is amid the face z = 0
  g.put_in({-2, -2, 0});
  g.put_in({2, -2, 0});  // (0, -2, 0) is on an edge
  CHECK(g.hull.vertices() == Numbers{3, 4, 5, 7, 8});
}

TEST_CASE("StarHull refuses a first tetrahedron that is flat, and only that") {
  StarHull hull;
  CHECK(!hull.start({1, 0, 0}, {0, 1, 0}, {1, 1, 0}));
  CHECK(!hull.start({1, 0, 0}, {2, 0, 0}, {0, 0, 1}));
  CHECK(!hull.start({1, 2, 3}, {4, 5, 6}, {5, 7, 9}));
  CHECK(hull.start({1, 0, 0}, {0, 0, 1}, {0, 1, 0}));
  CHECK(hull.vertices() == Numbers{1, 2, 3});
  CHECK(hull.start({1, 2, 3}, {4, 5, 6}, {5, 7, std::nextafter(9.0, 10.0)}));
  CHECK(hull.start({1, 2, 3}, {4, 5, 6}, {5, 7, std::nextafter(9.0, 0.0)}));
}

// Against the judge, and the hull's own clauses.
void check_hull(const std::vector<Point>& points) {
  auto g = grown(points);
  const Numbers expected = hull_vertices(points);
  if (!g) return;
  Numbers vertices;
  std::size_t still_outside = 0, above = 0, buried = 0, not_farthest = 0;
  for (std::uint32_t k = 0; k < points.size(); ++k) {
    const StarHull::Location location = g->hull.locate(points[k]);
    if (location.place == Place::outside) ++still_outside;
    if (location.place != Place::vertex) continue;
    vertices.push_back(k);
    if (!g->hull.is_on_hull(location.at) || g->points[location.at] != points[k]) ++buried;
  }
  for (const StarHull::Index v : g->hull.vertices()) {
    const auto facets = g->hull.facets_about(v);
    for (const StarHull::Index f : Numbers(facets.begin(), facets.end())) {
      for (const Point& p : points) above += g->hull.above(f, p) ? 1U : 0U;
      above += g->hull.above(f, Point::Zero()) ? 1U : 0U;
    }
    const Eigen::Vector3d direction = g->hull.normal_at(v);
    for (const Point& p : points) {
      const double higher = direction.dot(p - g->points[v]);
      if (higher > 1e-12 * (p.norm() + g->points[v].norm())) ++not_farthest;
    }
  }
  CHECK(vertices == expected);
  CHECK(still_outside == 0);
  CHECK(buried == 0);
  CHECK(above == 0);
  CHECK(not_farthest == 0);
}

void check_in_orders(std::vector<Point> points, int orders) {
  std::erase(points, Point(0, 0, 0));
  std::mt19937 random(1);
  for (int k = 0; k < orders; ++k) {
    check_hull(points);
    std::shuffle(points.begin(), points.end(), random);
  }
}

// Everywhere about a cube: in its centre, amid a face, on an edge, at a corner, and outside of it.
const Point kCentres[] = {{0, 0, 0},   {1, 0, 0},       {1, 1, 0},     {1, 1, 1}, {0.5, 0, 0},
                          {1, 0.5, 0}, {-1, 0, 1},      {3, 0, 0},     {2, 2, 2}, {3, 1, -1},
                          {0, -1, 0},  {0.5, 0.5, 0.5}, {1, 0.25, 0.5}};

TEST_CASE("StarHull: every order of a lattice gives the same vertices") {
  for (const Point& centre : kCentres) {
    CAPTURE(centre.transpose());
    check_in_orders(translated(lattice(1, 1.0), centre), 20);
    check_in_orders(translated(lattice(2, 0.5), centre), 4);
    check_in_orders(translated(lattice(1, 0.1), 0.1 * centre), 4);  // rounded
  }
}

TEST_CASE("StarHull: whole coordinates, where nearly all points are in planes with others") {
  std::mt19937 random(2);
  const auto whole = [&](int limit) {
    return static_cast<double>(std::uniform_int_distribution(-limit, limit)(random));
  };
  for (const Point& centre : kCentres) {
    for (int run = 0; run < 60; ++run) {
      std::vector<Point> points;
      const int size = 4 + run % 20, limit = 1 + run % 3;
      for (int k = 0; k < size; ++k) {
        points.emplace_back(limit * centre + Point(whole(limit), whole(limit), whole(limit)));
      }
      check_in_orders(points, 2);
    }
  }
}

TEST_CASE("StarHull: random points, points on spheres about the origin and away from it") {
  check_in_orders(ball(3, 400, 10.0), 2);
  check_in_orders(ball(4, 400, 10.0, 0.0, {30, 20, -10}), 2);
  check_in_orders(ball(4, 400, 10.0, 0.0, {10, 0, 0}), 2);
  check_in_orders(sphere(300, 10.0), 2);
  check_in_orders(translated(sphere(200, 1.0), {1e3, 0, 0}), 2);
}

TEST_CASE("StarHull: points a last digit apart") {
  std::mt19937 random(5);
  for (int run = 0; run < 20; ++run) {
    std::vector<Point> points;
    for (const Point& p : lattice(1, 1.0)) {
      if (random() % 2 == 0) points.push_back(Point(1, 2, 3) + 0x1p-50 * p);
      if (random() % 2 == 0) points.push_back(p + 0x1p-52 * Point(1, 1, 1));
      if (random() % 2 == 0) points.push_back(p);
    }
    check_in_orders(points, 2);
  }
}

TEST_CASE("StarHull::reach never overestimates and is tight") {
  GrownHull g = unit_tetrahedron();
  for (const Point& p : ball(1, 500, 5.0, 1.0)) g.put_in(p);
  std::size_t reached = 0, wrong = 0;
  for (const Point& p : sphere(2000, 1.0)) {
    const Eigen::Vector3d u = p.normalized();
    const double reach = g.hull.reach(u);
    if (reach == 0.0) continue;
    ++reached;
    if (g.hull.locate((1.0 - 1e-9) * reach * u).place != Place::inside) ++wrong;
    if (g.hull.locate((1.0 + 1e-9) * reach * u).place != Place::outside) ++wrong;
  }
  CHECK(wrong == 0);
  CHECK(reached > 1950);
}

TEST_CASE("StarHull::reach is 0 where the origin is on the hull") {
  StarHull hull = unit_tetrahedron().hull;
  CHECK(hull.reach(-Eigen::Vector3d::UnitX()) == 0.0);
  CHECK(hull.reach(Eigen::Vector3d(1, 1, -1e-9).normalized()) == 0.0);
  CHECK(hull.reach(Eigen::Vector3d(1, 1, 1).normalized()) == doctest::Approx(1.0 / std::sqrt(3.0)));
}

// Hulls about the origin, beside it, with it as a vertex; round and with long edges.
std::vector<GrownHull> hulls() {
  std::vector<GrownHull> all;
  all.push_back(grown(ball(1, 500, 5.0, 1.0)).value());
  all.push_back(grown(sphere(800, 5.0)).value());
  all.push_back(grown(ball(2, 12, 5.0)).value());
  all.push_back(grown(ball(3, 300, 5.0, 0.0, {4, 1, 2})).value());
  all.push_back(grown(ball(4, 300, 5.0, 0.0, {20, 1, 2})).value());
  all.push_back(grown(lattice(1, 3.0)).value());
  return all;
}

TEST_CASE("StarHull::surely_holds never holds a cone that reaches out, and most that do not") {
  std::size_t held = 0, inside = 0, wrong = 0;
  std::mt19937 random(6);
  for (GrownHull& g : hulls()) {
    const auto planes = g.planes();
    for (const Point& axis : ball(7, 1500, 1.0, 0.1)) {
      const double angle = std::pow(10.0, std::uniform_real_distribution(-6.0, -0.1)(random));
      const double reach = g.hull.reach(axis.normalized());
      for (const double part : {0.5, 0.9, 0.99, 0.9999, 1.001}) {
        const StarHull::Cone cone = cone_about(axis, angle, part * std::max(reach, 0.1));
        const bool holds = g.hull.surely_holds(cone);
        if (holds && !below_all(planes, cone, -1e-12)) ++wrong;
        if (!below_all(planes, cone, 1e-9)) continue;
        ++inside;
        held += holds ? 1U : 0U;
      }
    }
  }
  CHECK(wrong == 0);
  CHECK(inside > 10'000);
  CHECK(held > inside * 95 / 100);
}

}  // namespace
}  // namespace vantage::test
