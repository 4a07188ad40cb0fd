// The occlusion map hides nothing that is not inside the hull, and most of what is well inside.
#include "occlusion_map.hpp"

#include <doctest/doctest.h>

#include <algorithm>
#include <cmath>
#include <random>
#include <vector>

#include "hulls.hpp"
#include "scenes.hpp"

namespace vantage::test {
namespace {

using hpr::Eye, hpr::Kernel, hpr::OcclusionMap, hpr::StarHull;
using Planes = std::vector<GrownHull::Plane>;

// Turned lengths of 0 to 20 m are distances of 20 m to 0, or of 0 to infinity.
constexpr hpr::Settings kFlip{.kernel = Kernel::spherical_flip, .radius = 10.0};
constexpr hpr::Settings kInversion{.kernel = Kernel::inversion};

struct Asked {
  OcclusionMap& map;
  GrownHull& g;
  Eye eye;

  void fill(std::uint32_t tile) const { map.fill(tile, eye, g.hull); }
  void fill_all() const {
    for (std::uint32_t tile = 0; tile < OcclusionMap::kTiles.size(); ++tile) fill(tile);
  }
  [[nodiscard]] bool hides(const Point& p) const {
    return map.hides(p, p.squaredNorm(), [this](std::uint32_t tile) { fill(tile); });
  }
  [[nodiscard]] OcclusionMap::Answer hides(const OcclusionMap::Box& box) const {
    return map.hides(box, [this](std::uint32_t tile) { fill(tile); });
  }
};

bool is_inside(const Planes& planes, const Point& p, double margin) {
  return std::all_of(planes.begin(), planes.end(), [&](const GrownHull::Plane& plane) {
    return plane.outward.dot(p) < plane.offset + margin;
  });
}

struct Count {
  std::size_t inside = 0, hidden = 0, wrong = 0;
};

// Points a little below, at and above the hull.
void count_points(const PointCloud& directions, const Asked& asked, Count& count) {
  const Planes planes = asked.g.planes();
  for (const Point& direction : directions) {
    const Eigen::Vector3d u = direction.normalized();
    const double reach = std::max(asked.g.hull.reach(u), 0.1);
    for (const double part : {0.5, 0.9, 0.98, 0.9999, 1.0, 1.0 + 1e-9, 1.2}) {
      const Point p = asked.eye.distance_turned_to(part * reach) * u;
      if (!(p.squaredNorm() > 0.0)) continue;
      const bool hidden = asked.hides(p);
      const Point turned = asked.eye.turned(p);
      if (hidden && !is_inside(planes, turned, 1e-12 * turned.norm())) ++count.wrong;
      if (part > 0.95 || !is_inside(planes, turned, 0.0)) continue;
      ++count.inside;
      count.hidden += hidden ? 1U : 0U;
    }
  }
}

// Boxes, judged by their corners and points in them.
void count_boxes(const PointCloud& directions, double size, const Asked& asked, Count& count) {
  const Planes planes = asked.g.planes();
  std::mt19937 random(11);
  std::uniform_real_distribution<double> fraction(0.0, 1.0);
  for (const Point& direction : directions) {
    const Eigen::Vector3d u = direction.normalized();
    const double reach = std::max(asked.g.hull.reach(u), 0.1);
    for (const double part : {0.3, 0.6, 0.9, 0.98, 1.0, 1.1}) {
      const Point centre = asked.eye.distance_turned_to(part * reach) * u;
      const Eigen::Vector3d half = size * centre.norm() * Eigen::Vector3d(1.0, 0.3, 0.1);
      if (centre.norm() + half.norm() > asked.eye.distance_turned_to(0.0)) continue;  // not turned
      OcclusionMap::Box box{.low = centre - half, .high = centre + half, .nearest = 0.0};
      box.nearest = box.low.cwiseMax(-box.high).cwiseMax(0.0).norm();
      const bool hidden = asked.hides(box) == OcclusionMap::Answer::hidden;
      bool all_inside = true, well_inside = true;
      for (int k = 0; k < 24; ++k) {
        Eigen::Vector3d at = {fraction(random), fraction(random), fraction(random)};
        if (k < 8) at = Eigen::Vector3d(k & 1, (k >> 1) & 1, k >> 2);
        const Point p = box.low + (box.high - box.low).cwiseProduct(at);
        const Point turned = asked.eye.turned(p);
        all_inside = all_inside && is_inside(planes, turned, 1e-12 * turned.norm());
        well_inside = well_inside && is_inside(planes, turned, -0.1 * reach);
      }
      if (hidden && !all_inside) ++count.wrong;
      if (!well_inside) continue;
      ++count.inside;
      count.hidden += hidden ? 1U : 0U;
    }
  }
}

// Directions near the edges of the cube, nearer and nearer.
PointCloud along_edges(std::uint32_t seed) {
  PointCloud directions;
  for (Point p : ball(seed, 12, 1.0, 0.1)) {
    for (int axis = 0; axis < 3; ++axis) {
      const double toward = p[axis];
      for (int digits = 1; digits <= 16; ++digits) {
        p[(axis + 1) % 3] = toward * (1.0 - std::pow(10.0, -digits));
        directions.push_back(p);
      }
    }
  }
  return directions;
}

// Directions exactly on the lines between cells, and a last digit beside them.
PointCloud along_cells(std::uint32_t seed) {
  PointCloud directions;
  std::mt19937 random(seed);
  std::uniform_int_distribution<int> line(1, 255);
  for (int k = 0; k < 300; ++k) {
    Point p;
    p[k % 3] = k % 2 == 0 ? 1.0 : -1.0;
    p[(k + 1) % 3] = line(random) / 128.0 - 1.0;
    p[(k + 2) % 3] = line(random) / 128.0 - 1.0;
    directions.push_back(p);
    for (const double toward : {-2.0, 2.0}) {
      Point beside = p;
      beside[(k + 1) % 3] = std::nextafter(p[(k + 1) % 3], toward);
      directions.push_back(beside);
    }
  }
  return directions;
}

std::vector<GrownHull> hulls_to_look_from() {
  std::vector<GrownHull> all;
  all.push_back(grown(ball(1, 500, 5.0, 1.0)).value());
  all.push_back(grown(sphere(800, 5.0)).value());
  all.push_back(grown(ball(2, 14, 5.0)).value());
  all.push_back(grown(ball(3, 300, 5.0, 0.0, {4, 1, 2})).value());  // the origin on the hull
  all.push_back(grown(ball(3, 300, 5.0, 0.0, {5.5, 1, 2})).value());
  all.push_back(grown(lattice(1, 3.0)).value());
  return all;
}

TEST_CASE("OcclusionMap hides no point that is not inside the hull, and most that are") {
  OcclusionMap map;
  for (const hpr::Settings& settings : {kFlip, kInversion}) {
    Count anywhere, at_edges, between_cells;
    for (GrownHull& g : hulls_to_look_from()) {
      map.clear();
      const Asked asked{map, g, Eye(Point::Zero(), settings)};
      asked.fill_all();
      count_points(ball(4, 1000, 1.0, 0.1), asked, anywhere);
      count_points(along_edges(5), asked, at_edges);
      count_points(along_cells(6), asked, between_cells);
    }
    CHECK(anywhere.wrong == 0);
    CHECK(at_edges.wrong == 0);
    CHECK(between_cells.wrong == 0);
    CHECK(anywhere.inside > 5'000);
    CHECK(anywhere.hidden > anywhere.inside * 95 / 100);
    CHECK(at_edges.inside > 2'000);
    CHECK(at_edges.hidden > at_edges.inside / 5);  // nearly on the edge it is not plain
  }
}

TEST_CASE("OcclusionMap hides no box of which a point is not inside the hull, and most that are" *
          doctest::test_suite("slow")) {
  OcclusionMap map;
  for (const hpr::Settings& settings : {kFlip, kInversion}) {
    for (const double size : {1e-9, 1e-6, 1e-4, 1e-3, 5e-3, 0.02, 0.06, 0.2, 0.6, 2.0}) {
      CAPTURE(size);
      Count anywhere, at_edges;
      for (GrownHull& g : hulls_to_look_from()) {
        map.clear();
        const Asked asked{map, g, Eye(Point::Zero(), settings)};
        asked.fill_all();
        count_boxes(ball(4, 250, 1.0, 0.1), size, asked, anywhere);
        count_boxes(along_edges(5), size, asked, at_edges);
      }
      CHECK(anywhere.wrong == 0);
      CHECK(at_edges.wrong == 0);
      if (size > 0.05) continue;  // too wide
      CHECK(anywhere.inside > 1'000);
      CHECK(anywhere.hidden > anywhere.inside * (size < 0.01 ? 95 : 80) / 100);
    }
  }
}

TEST_CASE(
    "OcclusionMap: what was found stays right while the hull grows, and cleared for another") {
  OcclusionMap map;
  const PointCloud directions = ball(6, 300, 1.0, 0.1);
  const PointCloud points = ball(7, 2000, 5.0, 3.0);
  GrownHull g = grown(std::span(points).first(10)).value();
  const Asked asked{map, g, Eye(Point::Zero(), kFlip)};
  Count growing;
  asked.fill_all();
  for (std::size_t k = 10; k < points.size(); ++k) {
    if (g.put_in(points[k]).place == StarHull::Place::outside) {
      map.hull_grew_in(OcclusionMap::kTiles.bin_of(points[k]));
    }
    if (k % 400 != 0) continue;
    count_points(directions, asked, growing);
    count_boxes(directions, 1e-3, asked, growing);
  }
  CHECK(growing.wrong == 0);
  CHECK(growing.hidden > 0);

  GrownHull smaller = grown(ball(8, 200, 2.0)).value();
  map.clear();
  const Asked asked_again{map, smaller, Eye(Point::Zero(), kFlip)};
  Count after;
  for (int again = 0; again < 3; ++again) count_points(directions, asked_again, after);
  CHECK(after.wrong == 0);
}

TEST_CASE(
    "OcclusionMap fills a tile where enough is asked, and again when the hull has grown there") {
  OcclusionMap map;
  GrownHull g = grown(sphere(800, 5.0)).value();
  const Eye eye(Point::Zero(), kFlip);
  const Point deep(19.0, 1.0, 2.0);  // 1 m from the viewpoint once turned
  const std::uint32_t there = OcclusionMap::kTiles.bin_of(deep);
  std::size_t fills = 0;
  const auto fill = [&](std::uint32_t tile) {
    CHECK(tile == there);
    ++fills;
    map.fill(tile, eye, g.hull);
  };
  const auto hides = [&] { return map.hides(deep, deep.squaredNorm(), fill); };
  CHECK(!hides());  // one point is not worth it
  CHECK(fills == 0);
  for (int k = 0; k < 200; ++k) (void)hides();
  CHECK(hides());
  CHECK(fills == 1);
  for (int k = 0; k < 200; ++k) map.hull_grew_in(there);
  CHECK(hides());
  CHECK(hides());
  CHECK(fills == 2);
  map.clear();
  CHECK(!hides());
  CHECK(fills == 2);
}

}  // namespace
}  // namespace vantage::test
