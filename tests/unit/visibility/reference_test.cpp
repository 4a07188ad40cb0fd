// hidden_point_removal against references: a brute-force hull, and Qhull on all points.
#include <doctest/doctest.h>

#include <Eigen/Geometry>
#include <algorithm>
#include <array>
#include <cmath>
#include <set>
#include <stdexcept>

#include "exact_visibility.hpp"
#include "qhull.hpp"
#include "scenes.hpp"

namespace vantage::test {
namespace {

using hpr::Kernel;
using Vector3 = Eigen::Matrix<long double, 3, 1>;

// Whether d is above (+1) or below (-1) the plane of a, b, c; throws if 64 bits cannot tell.
int side_of_plane(const Vector3& a, const Vector3& b, const Vector3& c, const Vector3& d) {
  const Vector3 u = b - a, v = c - a, w = d - a;
  const long double determinant = u.cross(v).dot(w);
  const long double bound =
      16 * std::numeric_limits<long double>::epsilon() * u.norm() * v.norm() * w.norm();
  if (std::abs(determinant) <= bound) throw std::runtime_error("the cloud is too degenerate");
  return determinant > 0 ? 1 : -1;
}

// Eqs. 7-9 as they stand: a triple of points is a facet if all others are on one side of it.
IndexList brute_force(PointsView map, const Point& viewpoint, Kernel kernel, double radius) {
  std::vector<Vector3> turned;
  for (const Point& q : map) {
    const Point p = q - viewpoint;
    const double r = p.norm();
    const Point flipped = p + 2.0 * (radius - r) * p / r;
    const Point inverted = radius * radius / (r * r) * p;
    turned.push_back((kernel == Kernel::inversion ? inverted : flipped).cast<long double>());
  }
  turned.push_back(Vector3::Zero());
  std::set<std::size_t> vertices;
  for (std::size_t i = 0; i < turned.size(); ++i) {
    for (std::size_t j = i + 1; j < turned.size(); ++j) {
      for (std::size_t k = j + 1; k < turned.size(); ++k) {
        std::array<bool, 2> found{};
        for (std::size_t l = 0; l < turned.size() && !(found[0] && found[1]); ++l) {
          if (l == i || l == j || l == k) continue;
          found[side_of_plane(turned[i], turned[j], turned[k], turned[l]) > 0 ? 1 : 0] = true;
        }
        if (!(found[0] && found[1])) vertices.insert({i, j, k});
      }
    }
  }
  vertices.erase(map.size());
  return {vertices.begin(), vertices.end()};
}

// R = alpha * D, and no less than the flip needs for a viewpoint outside the map.
hpr::Settings reaching_flip(PointsView map, const Point& viewpoint, double alpha) {
  hpr::Settings settings = flip(map, alpha);
  for (const Point& p : map) {
    settings.radius = std::max(settings.radius, 1.01 * (p - viewpoint).norm());
  }
  return settings;
}

void check_equals_qhull(PointsView map, const Point& viewpoint, const hpr::Settings& settings) {
  const auto ours = hpr::hidden_point_removal(map, viewpoint, settings);
  REQUIRE_MESSAGE(ours, to_string(ours.error()));
  const TurnedPoints points = turned_points(map, viewpoint, settings);
  const auto vertices = qhull_vertices(points.turned);
  REQUIRE_MESSAGE(vertices, to_string(vertices.error()));
  IndexList by_qhull;
  for (const RoughVertex& v : *vertices) by_qhull.push_back(points.indices[v.index]);
  CHECK(!by_qhull.empty());
  CHECK(*ours == by_qhull);
}

TEST_CASE("hpr equals a brute-force hull on random clouds" * doctest::test_suite("slow")) {
  const auto check = [](const PointCloud& cloud, const Point& viewpoint, std::size_t& hidden) {
    for (const double alpha : {1.0, 3.0, 100.0, 1e4}) {
      const auto settings = reaching_flip(cloud, viewpoint, alpha);
      const auto result = hpr::hidden_point_removal(cloud, viewpoint, settings);
      REQUIRE(result);
      CHECK(*result == brute_force(cloud, viewpoint, Kernel::spherical_flip, settings.radius));
      hidden += cloud.size() - result->size();
    }
    const auto result = hpr::hidden_point_removal(cloud, viewpoint, inversion());
    REQUIRE(result);
    CHECK(*result == brute_force(cloud, viewpoint, Kernel::inversion, 17.0));
    hidden += cloud.size() - result->size();
  };
  std::size_t hidden = 0;
  for (std::uint32_t seed = 1; seed <= 8; ++seed) {
    const PointCloud cloud = ball(seed, 60, 10.0);
    check(cloud, Point(0.3, -0.2, 0.1), hidden);  // amid the points: the viewpoint is inside
    check(cloud, Point(9.0, 3.0, -2.0), hidden);  // beside them: it is a vertex of the hull
    check(joined(ball(seed + 50, 40, 2.0, 0.0, {20, 1, 3}),
                 ball(seed + 99, 40, 4.0, 0.0, {30, 1, 3})),
          Point(-1.0, 0.5, 0.2), hidden);
  }
  check(ball(7, 200, 10.0, 1.0), Point(0.1, 0.0, 0.2), hidden);
  CHECK(hidden > 1000);
}

// Where no four turned points are in a plane; where they are, Qhull's tolerance decides, and the
// exact rule is tested instead.
TEST_CASE("hpr equals Qhull on all points") {
  const auto check = [](const PointCloud& cloud, const Point& viewpoint) {
    for (const double alpha : {1.0, 100.0, 1e4}) {
      CAPTURE(alpha);
      check_equals_qhull(cloud, viewpoint, reaching_flip(cloud, viewpoint, alpha));
    }
    check_equals_qhull(cloud, viewpoint, inversion());
  };
  SUBCASE("random ball, viewpoint inside") { check(ball(1, 20000, 30.0), {0.1, 0.2, 0.3}); }
  SUBCASE("random ball, viewpoint near its rim") { check(ball(2, 20000, 30.0), {29, 1, 2}); }
  SUBCASE("small far cluster") { check(ball(3, 5000, 1.0), {40, 20, 10}); }
  SUBCASE("sphere from inside") { check(sphere(5000, 10.0), {0.5, 1.0, -0.25}); }
  SUBCASE("two parallel walls") {
    check(joined(wall(10.0, 40, 0.1), wall(12.0, 40, 0.1)), {0.01, 0.02, 0.03});
  }
  SUBCASE("ground only, viewpoint above it") {
    PointCloud ground;
    for (const Point& p : wall(0.0, 60, 0.25)) ground.emplace_back(p.y(), p.z(), 0.0);
    check(ground, {0.03, 0.04, 1.0});
  }
  SUBCASE("5,000 km from the origin") {
    const Eigen::Vector3d far(5e6, -5e6, 100.0);
    check(translated(ball(4, 20000, 30.0), far), far + Eigen::Vector3d(0.1, 0.2, 0.3));
  }
}

}  // namespace
}  // namespace vantage::test
