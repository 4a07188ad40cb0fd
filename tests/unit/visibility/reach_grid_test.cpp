// The grid of reaches never holds a cone that reaches out of the hull, and most that do not.
#include <doctest/doctest.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <random>
#include <vector>

#include "hulls.hpp"
#include "reach_grid.hpp"
#include "scenes.hpp"

namespace vantage::test {
namespace {

using hpr::ReachGrid, hpr::StarHull;

struct Count {
  std::size_t inside = 0, held = 0, wrong = 0;
};

// Cones of that angle that end a little below, at and above the hull.
void count(const PointCloud& axes, double angle, GrownHull& g, ReachGrid& grid, Count& counted) {
  const auto planes = g.planes();
  for (const Point& axis : axes) {
    const double reach = std::max(g.hull.reach(axis.normalized()), 0.1);
    for (const double part : {0.6, 0.9, 0.99, 0.9999, 1.0 + 1e-9, 1.2}) {
      const StarHull::Cone cone = cone_about(axis, angle, part * reach);
      const bool holds = grid.surely_holds(cone, g.hull);
      if (holds && !below_all(planes, cone, -1e-12)) ++counted.wrong;
      if (part > 0.95 || !below_all(planes, cone, 0.0)) continue;
      ++counted.inside;
      counted.held += holds ? 1U : 0U;
    }
  }
}

// Directions near the edges of the cube, nearer and nearer.
PointCloud along_edges(std::uint32_t seed) {
  PointCloud axes;
  for (Point p : ball(seed, 12, 1.0, 0.1)) {
    for (int axis = 0; axis < 3; ++axis) {
      const double toward = p[axis];
      for (int digits = 1; digits <= 12; ++digits) {
        p[(axis + 1) % 3] = toward * (1.0 - std::pow(10.0, -digits));
        axes.push_back(p);
      }
    }
  }
  return axes;
}

TEST_CASE("ReachGrid never holds a cone that reaches out of the hull") {
  std::vector<GrownHull> hulls;
  hulls.push_back(grown(ball(1, 500, 5.0, 1.0)).value());
  hulls.push_back(grown(sphere(800, 5.0)).value());
  hulls.push_back(grown(ball(2, 14, 5.0)).value());
  hulls.push_back(grown(ball(3, 300, 5.0, 0.0, {4, 1, 2})).value());
  hulls.push_back(grown(lattice(1, 3.0)).value());
  ReachGrid grid;
  for (const double angle : {1e-9, 1e-6, 1e-4, 1e-3, 5e-3, 0.02, 0.06, 0.1, 0.3, 1.0, 1.5}) {
    CAPTURE(angle);
    Count anywhere, at_edges;
    for (GrownHull& g : hulls) {
      grid.clear();
      count(ball(4, 250, 1.0, 0.1), angle, g, grid, anywhere);
      count(along_edges(5), angle, g, grid, at_edges);
    }
    CHECK(anywhere.wrong == 0);
    CHECK(at_edges.wrong == 0);
    if (angle > 0.05) continue;  // too wide for the grid
    CHECK(anywhere.inside > 800);
    CHECK(anywhere.held > anywhere.inside * (angle < 0.01 ? 95 : 70) / 100);
    CHECK(at_edges.held > at_edges.inside * 3 / 4);
  }
}

TEST_CASE("ReachGrid: what was found stays right while the hull grows, and cleared for another") {
  ReachGrid grid;
  const PointCloud axes = ball(6, 300, 1.0, 0.1);
  const PointCloud points = ball(7, 2000, 5.0, 3.0);
  GrownHull g = grown(std::span(points).first(10)).value();
  Count counted;
  for (std::size_t k = 10; k < points.size(); ++k) {
    g.put_in(points[k]);
    if (k % 400 != 0) continue;
    for (const double angle : {1e-4, 1e-2}) count(axes, angle, g, grid, counted);
  }
  CHECK(counted.wrong == 0);
  const std::size_t held_before = counted.held;
  CHECK(held_before > 0);

  GrownHull smaller = grown(ball(8, 200, 2.0)).value();
  grid.clear();
  Count after;
  for (const double angle : {1e-4, 1e-2}) count(axes, angle, smaller, grid, after);
  CHECK(after.wrong == 0);
  CHECK(after.held > after.inside * 3 / 4);
}

// Directions that are no longer beyond the edge by the last digit, and then the ones whose corners
// would be taken for theirs if a number of a corner ran over.
TEST_CASE("ReachGrid keeps corners apart at the edge of the cube") {
  GrownHull g = grown(std::vector<Point>{
                          {1, 0, 0}, {0, 3, 0}, {0, 0, 1}, {-1, 0, 0}, {0, -0.3, 0}, {0, 0, -1}})
                    .value();
  const auto planes = g.planes();
  ReachGrid grid;
  for (int row = 137; row < 144; ++row) {
    const double w = (row + 0.5) / 128.0 - 1.0, x = 1.0 / std::sqrt(2.0 + w * w);
    const StarHull::Cone cone{
        .axis = {x, std::nextafter(x, 0.0), w * x}, .sine = 1e-17, .cosine = 1.0, .length = 0.1};
    CHECK(cone.axis.y() / cone.axis.x() < 1.0);
    (void)grid.surely_holds(cone, g.hull);
  }
  const Eigen::Vector3d axis = Eigen::Vector3d(1.0, -1.0 + 0.5 / 256, 12.5 / 128).normalized();
  const StarHull::Cone reaches_out = cone_about(axis, 1e-9, 1.0005 * g.hull.reach(axis));
  CHECK(!below_all(planes, reaches_out, 0.0));
  CHECK(!grid.surely_holds(reaches_out, g.hull));
  CHECK(grid.surely_holds(cone_about(axis, 1e-9, 0.99 * g.hull.reach(axis)), g.hull));
}

}  // namespace
}  // namespace vantage::test
