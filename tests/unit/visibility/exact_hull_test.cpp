// The judge itself, against the hull's other definition: p is no vertex iff it lies in a
// tetrahedron, triangle or segment of other points, or at the origin (Caratheodory).
#include <doctest/doctest.h>

#include <algorithm>
#include <array>
#include <boost/multiprecision/cpp_int.hpp>
#include <cmath>
#include <random>

#include "exact_hull.hpp"
#include "exact_visibility.hpp"
#include "scenes.hpp"

namespace vantage::test {
namespace {

using Rational = boost::multiprecision::cpp_rational;

template <class Number>
struct Exact {
  Number x, y, z;
  friend Exact operator-(const Exact& a, const Exact& b) {
    return {a.x - b.x, a.y - b.y, a.z - b.z};
  }
  friend bool operator==(const Exact&, const Exact&) = default;
};

template <class Number>
Number dot(const Exact<Number>& a, const Exact<Number>& b) {
  return a.x * b.x + a.y * b.y + a.z * b.z;
}
template <class Number>
Exact<Number> cross(const Exact<Number>& a, const Exact<Number>& b) {
  return {a.y * b.z - a.z * b.y, a.z * b.x - a.x * b.z, a.x * b.y - a.y * b.x};
}
template <class Number>
int sign(const Number& v) {
  return v > 0 ? 1 : v < 0 ? -1 : 0;
}

template <class Number>
bool in_segment(const Exact<Number>& p, const Exact<Number>& a, const Exact<Number>& b) {
  return cross(a - p, b - p) == Exact<Number>{0, 0, 0} && sign(dot(a - p, b - p)) <= 0;
}
template <class Number>
bool in_triangle(const Exact<Number>& p, const Exact<Number>& a, const Exact<Number>& b,
                 const Exact<Number>& c) {
  const auto n = cross(b - a, c - a);
  if (n == Exact<Number>{0, 0, 0} || sign(dot(n, p - a)) != 0) return false;
  return sign(dot(n, cross(b - a, p - a))) >= 0 && sign(dot(n, cross(c - b, p - b))) >= 0 &&
         sign(dot(n, cross(a - c, p - c))) >= 0;
}
template <class Number>
bool in_tetrahedron(const Exact<Number>& p, const std::array<Exact<Number>, 4>& corners) {
  for (std::size_t k = 0; k < 4; ++k) {
    const auto &a = corners[(k + 1) % 4], &b = corners[(k + 2) % 4], &c = corners[(k + 3) % 4];
    const auto n = cross(b - a, c - a);
    const int side = sign(dot(n, corners[k] - a));
    if (side == 0 || sign(dot(n, p - a)) == -side) return false;
  }
  return true;
}

template <class Number>
bool in_hull(const Exact<Number>& p, const std::vector<Exact<Number>>& of) {
  const std::size_t n = of.size();
  for (std::size_t i = 0; i < n; ++i) {
    if (of[i] == p) return true;
    for (std::size_t j = 0; j < i; ++j) {
      if (in_segment(p, of[i], of[j])) return true;
      for (std::size_t k = 0; k < j; ++k) {
        if (in_triangle(p, of[i], of[j], of[k])) return true;
        for (std::size_t l = 0; l < k; ++l) {
          if (in_tetrahedron(p, {of[i], of[j], of[k], of[l]})) return true;
        }
      }
    }
  }
  return false;
}

// The vertices of the hull of the points and the origin by the definition above.
template <class Number>
std::vector<std::uint32_t> brute_force(const std::vector<Point>& points) {
  const auto exact = [](const Point& p) {
    return Exact<Number>{Number(p.x()), Number(p.y()), Number(p.z())};
  };
  std::vector<std::uint32_t> vertices;
  for (std::uint32_t k = 0; k < points.size(); ++k) {
    std::vector<Exact<Number>> others{{0, 0, 0}};
    for (const Point& p : points) {
      if (p != points[k]) others.push_back(exact(p));
    }
    if (!in_hull(exact(points[k]), others)) vertices.push_back(k);
  }
  return vertices;
}

void check(const std::vector<Point>& points, const std::vector<std::uint32_t>& expected) {
  CHECK(hull_vertices(points) == expected);
  std::vector<std::uint32_t> one_by_one;
  for (std::uint32_t k = 0; k < points.size(); ++k) {
    if (is_vertex(points, k)) one_by_one.push_back(k);
  }
  CHECK(one_by_one == expected);
}

// Points with whole coordinates in a small box: most are on a line or in a plane with others.
std::vector<Point> grid_points(std::mt19937& random, std::size_t size, const Point& half,
                               const Point& centre) {
  const auto within = [&](double limit) {
    const int whole = static_cast<int>(limit);
    return static_cast<double>(std::uniform_int_distribution(-whole, whole)(random));
  };
  std::vector<Point> points;
  for (std::size_t k = 0; k < size; ++k) {
    points.emplace_back(centre + Point(within(half.x()), within(half.y()), within(half.z())));
  }
  return points;
}

TEST_CASE("the exact hull equals the definition on whole coordinates, where all is degenerate") {
  std::mt19937 random(1);
  const Point boxes[] = {{1, 1, 1}, {2, 2, 2}, {3, 3, 3}, {2, 2, 0},
                         {3, 0, 0}, {4, 1, 0}, {9, 9, 9}};
  const Point centres[] = {{0, 0, 0}, {1, 0, 0}, {2, 2, 2}, {5, 1, 0}, {3, 0, 0}, {-20, 4, 7}};
  std::size_t vertices = 0, points = 0;
  for (const Point& box : boxes) {
    for (const Point& centre : centres) {
      for (const std::size_t size : {1U, 2U, 3U, 4U, 5U, 7U, 9U, 12U, 12U, 12U, 12U, 16U}) {
        const auto set = grid_points(random, size, box, centre);
        const auto expected = brute_force<std::int64_t>(set);
        check(set, expected);
        vertices += expected.size();
        points += size;
      }
    }
  }
  CHECK(vertices > points / 4);
  CHECK(vertices < points * 3 / 4);
}

TEST_CASE("the exact hull equals the definition on turned points, in fractions") {
  const auto compare = [](const PointCloud& cloud, const Point& viewpoint) {
    for (const Question& question : {Question{.alpha = 2.0}, Question{.alpha = 1e4},
                                     Question{.kernel = hpr::Kernel::inversion}}) {
      CAPTURE(to_string(question));
      const auto turned =
          turned_points(cloud, viewpoint, question.settings(bounds_of(cloud))).turned;
      check(turned, brute_force<Rational>(turned));
    }
  };
  std::mt19937 random(2);
  for (std::uint32_t seed = 1; seed <= 2; ++seed) {
    compare(ball(seed, 10, 10.0), {0.3, -0.2, 0.1});
    compare(ball(seed, 8, 10.0), {9, 8, 7});
    compare(grid_points(random, 10, {1, 1, 1}, Point::Zero()), Point::Zero());
    compare(grid_points(random, 10, {1, 1, 1}, {0, 0, 0.5}), Point::Zero());
    compare(grid_points(random, 10, {2, 2, 0}, {0.1, 0.2, 0}), {0.7, 0.3, 0});
    compare(grid_points(random, 8, {1, 1, 1}, {5e6, 1.0 / 3.0, 0}), {5e6, 1.0 / 3.0, 0});
    compare(grid_points(random, 6, {4, 0, 0}, {0.1, 0, 0}), {0.7, 0, 0});
  }
}

TEST_CASE("the exact hull where rounding decides: points a last digit off a plane") {
  const double up = std::nextafter(1.0, 2.0);
  std::vector<Point> square{{1, 1, 1}, {-1, 1, 1}, {-1, -1, 1}, {1, -1, 1}, {0.25, 0.5, 1}};
  check(square, {0, 1, 2, 3});
  square.back().z() = up;
  check(square, {0, 1, 2, 3, 4});
  square.back().z() = std::nextafter(1.0, 0.0);
  check(square, {0, 1, 2, 3});
  SUBCASE("at very different scales") {
    for (const double tiny : {1e-30, 1e-200, 5e-324}) {
      check({{1, 1, 1}, {-1, 1, 1}, {-1, -1, 1}, {1, -1, 1}, {0.25, 0.5, 1}, {tiny, 0, 1}},
            {0, 1, 2, 3});
      check({{1, 0, 0}, {0, 1, 0}, {0.5, 0.5, tiny}, {0.5, 0.5, 0}}, {0, 1, 2});
      check({{1, 0, 0}, {0, 1, 0}, {0.5, 0.5, tiny}, {0.25, 0.25, -tiny}}, {0, 1, 2, 3});
      check({{1e150, 0, 0}, {0, 1e150, 0}, {tiny, tiny, tiny}}, {0, 1, 2});
    }
  }
  SUBCASE("a ball a last digit thick") {
    std::mt19937 random(3);
    for (int run = 0; run < 4; ++run) {
      auto points = grid_points(random, 9, {2, 2, 2}, Point::Zero());
      for (Point& p : points) p = Point(1, 2, 3) + 0x1p-50 * p;
      check(points, brute_force<Rational>(points));
    }
  }
}

TEST_CASE("the exact hull of few, flat and coincident points") {
  check({}, {});
  check({{0, 0, 0}}, {});
  check({{1, 2, 3}}, {0});
  check({{1, 2, 3}, {1, 2, 3}}, {0, 1});
  check({{1, 2, 3}, {2, 4, 6}}, {1});
  check({{1, 2, 3}, {-2, -4, -6}}, {0, 1});
  check({{1, 0, 0}, {0, 1, 0}, {0.5, 0.5, 0}, {0.5, 0.5, 0}}, {0, 1});
  check({{1, 0, 0}, {0, 1, 0}, {0.75, 0.75, 0}, {0.75, 0.75, 0}}, {0, 1, 2, 3});
}

TEST_CASE("all points of a lattice's corners are vertices, the rest of its surface is not") {
  const PointCloud cube = lattice(15, 1.0);
  const auto vertices = hull_vertices(cube);
  CHECK(vertices.size() == 8);
  for (const std::uint32_t k : vertices) CHECK(cube[k].cwiseAbs() == Point(15, 15, 15));
}

TEST_CASE("what differs from Qhull is judged exactly") {
  SUBCASE("Qhull is right: one point left out, one hidden point put in") {
    const PointCloud map = ball(61, 500, 10.0);
    const hpr::Settings settings = flip(map, 1.0);
    auto seen = exactly_seen(map, Point::Zero(), settings).value();
    const auto same = compare_with_qhull(seen, map, Point::Zero(), settings).value();
    CHECK(same.differences == 0);
    CHECK(same.seen == seen.size());
    std::uint32_t hidden = 0;
    while (std::binary_search(seen.begin(), seen.end(), hidden)) ++hidden;
    REQUIRE(hidden < map.size());
    seen.erase(seen.begin() + 7);
    seen.insert(std::lower_bound(seen.begin(), seen.end(), hidden), hidden);
    const auto wrong = compare_with_qhull(seen, map, Point::Zero(), settings).value();
    CHECK(wrong.differences == 2);
    CHECK(wrong.for_qhull == 2);
    CHECK(wrong.for_us == 0);
  }
  SUBCASE("Qhull's tolerance decides wrongly: a lattice turned about one of its points") {
    const PointCloud map = lattice(4, 0.5);
    const auto seen = exactly_seen(map, Point::Zero(), inversion()).value();
    const auto all = compare_with_qhull(seen, map, Point::Zero(), inversion()).value();
    CHECK(all.differences > 0);
    CHECK(all.for_us == all.differences);
    const auto none = compare_with_qhull({}, map, Point::Zero(), inversion()).value();
    CHECK(none.for_qhull == none.differences);
  }
}

}  // namespace
}  // namespace vantage::test
