#include "view/borders.hpp"

#include <doctest/doctest.h>

#include <numeric>

using namespace vantage;
using namespace vantage::view;

namespace {

HalfOpenBox box(double x0, double y0, double x1, double y1) { return {{x0, y0}, {x1, y1}}; }

double length(const std::vector<Segment>& segments) {
  return std::accumulate(segments.begin(), segments.end(), 0.0,
                         [](double sum, const Segment& s) { return sum + (s.b - s.a).norm(); });
}

}  // namespace

TEST_CASE("the border of a box and of a polygon are their sides") {
  CHECK(length(outline(box(0, 0, 3, 2))) == doctest::Approx(10.0));
  const auto triangle = outline(ConvexPolygon{{{0, 0}, {3, 0}, {0, 4}}});
  CHECK(triangle.size() == 3);
  CHECK(length(triangle) == doctest::Approx(12.0));
}

TEST_CASE("the border of a union leaves out where its boxes meet") {
  SUBCASE("two side by side") {
    CHECK(length(outline(BoxUnion{{box(0, 0, 1, 1), box(1, 0, 2, 1)}})) == doctest::Approx(6.0));
  }
  SUBCASE("an L of unequal boxes") {
    CHECK(length(outline(BoxUnion{{box(0, 0, 4, 1), box(0, 1, 1, 3)}})) == doctest::Approx(14.0));
  }
  SUBCASE("overlapping ones") {
    CHECK(length(outline(BoxUnion{{box(0, 0, 2, 2), box(1, 1, 3, 3)}})) == doctest::Approx(12.0));
  }
  SUBCASE("apart") {
    CHECK(length(outline(BoxUnion{{box(0, 0, 1, 1), box(2, 0, 3, 1)}})) == doctest::Approx(8.0));
  }
  SUBCASE("touching at a corner") {
    CHECK(length(outline(BoxUnion{{box(0, 0, 1, 1), box(1, 1, 2, 2)}})) == doctest::Approx(8.0));
  }
}

TEST_CASE("lines lie over the terrain, whatever stands on it or is stray below it") {
  PointCloud points;
  for (double x = 0; x < 100; x += 0.5) {
    for (double y = 0; y < 20; y += 0.5) {
      points.emplace_back(x, y, 0.1 * x);
      points.emplace_back(x, y, 0.1 * x + 8.0);
    }
  }
  points.emplace_back(50.0, 10.0, -300.0);
  const Terrain terrain(points);
  const PointCloud line = draped({{0, 10}, {100, 10}}, terrain, 0.5);
  CHECK(line.front().x() == 0.0);
  CHECK(line.back().x() == 100.0);
  CHECK(line.size() > 20);
  for (const Point& p : line) CHECK(std::abs(p.z() - 0.1 * p.x() - 0.5) < 0.5);
}

TEST_CASE("a terrain of no points is flat") { CHECK(Terrain({}).height({3, 4}) == 0.0); }
