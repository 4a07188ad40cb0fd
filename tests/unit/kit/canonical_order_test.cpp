#include "vantage/kit/canonical_order.hpp"

#include <doctest/doctest.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <random>
#include <vector>

namespace vantage {
namespace {

/// Points on both sides of many borders, some equal, some far away.
PointCloud near_borders(std::size_t n) {
  std::mt19937 random(4);
  const auto coordinate = [&] {
    const double border = 5.0 * (static_cast<double>(random() % 7) - 3.0);
    switch (random() % 4) {
      case 0: return border;
      case 1: return std::nextafter(border, -100.0);
      case 2: return border + static_cast<double>(random() % 4096) / 700.0;
      default: return (random() % 50 == 0 ? 0x1p99 : 1.0) * (static_cast<double>(random() % 9) - 4);
    }
  };
  PointCloud points;
  for (std::size_t i = 0; i < n; ++i) {
    points.emplace_back(coordinate(), coordinate(), coordinate());
    if (i % 9 == 0) points.push_back(points[random() % points.size()]);
  }
  return points;
}

TEST_CASE("canonical order: a strict weak order that only equal points share a place of") {
  const PointCloud points = near_borders(150);
  for (const Point& a : points) {
    CHECK_FALSE(canonically_before(a, a));
    for (const Point& b : points) {
      CHECK((canonically_before(a, b) || canonically_before(b, a)) == (a != b));
      CHECK_FALSE((canonically_before(a, b) && canonically_before(b, a)));
      const auto places = CanonicalPlace::of(a) <=> CanonicalPlace::of(b);
      if (places != 0) CHECK(canonically_before(a, b) == (places < 0));
      if (!canonically_before(a, b)) continue;
      for (const Point& c : points) {
        if (canonically_before(b, c)) REQUIRE(canonically_before(a, c));
      }
    }
  }
}

TEST_CASE("canonical order: rows, columns and layers of 5 m, then Morton's curve") {
  const PointCloud ordered{
      Point(99, -0.1, 50),                                               // the row below
      Point(-5, 4.9, -3),                                                // a column
      Point(1, 1, -0.001),                                               // the layer below
      Point(0.1, 0.1, 0.1), Point(2.6, 0.1, 0.1), Point(0.1, 2.6, 0.1),  // eighths of a cube:
      Point(2.6, 2.6, 0.1), Point(0.1, 0.1, 2.6), Point(2.6, 0.1, 2.6),  // x, then y, then z
      Point(0.1, 2.6, 2.6), Point(2.6, 2.6, 2.6), Point(0, 0, 5),
      Point(5, 0, 0),       Point(0, 5, 0)};
  for (std::size_t i = 1; i < ordered.size(); ++i) {
    CAPTURE(i);
    CHECK(canonically_before(ordered[i - 1], ordered[i]));
  }
  CHECK(canonically_before(Point(1, 1, 1), Point(1, 1.0001, 1)));
  CHECK(canonically_before(Point(1, 1, 1), Point(1.0001, 1, 1)));
  CHECK(canonical_cell(-1e-300) == -1);
  CHECK(canonical_cell(std::numeric_limits<double>::max()) > 1e300);
}

TEST_CASE("canonical order: the points of a cell, from any order") {
  PointCloud points;
  for (const Point& p : near_borders(4000)) {
    if (canonical_cell(p.x()) == 0 && canonical_cell(p.y()) == -1) points.push_back(p);
  }
  REQUIRE(points.size() > 30);
  PointCloud sorted = points;
  std::ranges::stable_sort(sorted, canonically_before);
  std::mt19937 random(1);
  for (int i = 0; i < 5; ++i) {
    sort_cell(points);
    CHECK(points == sorted);
    std::shuffle(points.begin(), points.end(), random);
  }
  sort_cell({});
}

}  // namespace
}  // namespace vantage
