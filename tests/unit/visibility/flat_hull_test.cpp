// The hull of points in one plane or on one line with the origin, against the exact judge.
#include <doctest/doctest.h>

#include <algorithm>
#include <random>
#include <vector>

#include "exact_hull.hpp"
#include "flat_hull.hpp"

namespace vantage::test {
namespace {

void check(const std::vector<Point>& points) {
  auto vertices = hpr::flat_hull_vertices(points);
  std::sort(vertices.begin(), vertices.end());
  const auto expected = hull_vertices(points);
  CHECK(std::equal(vertices.begin(), vertices.end(), expected.begin(), expected.end()));
}

TEST_CASE("flat_hull_vertices equals the exact judge on whole coordinates") {
  std::mt19937 random(1);
  const auto whole = [&](int limit) {
    return static_cast<double>(std::uniform_int_distribution(-limit, limit)(random));
  };
  const Eigen::Vector3d spans[][2] = {{{1, 0, 0}, {0, 1, 0}}, {{0, 1, 0}, {0, 0, 1}},
                                      {{0, 0, 1}, {1, 0, 0}}, {{1, 2, 3}, {-3, 1, 2}},
                                      {{1, 1, 0}, {0, 0, 2}}, {{2, -1, 4}, {0, 0, 0}},
                                      {{0, 0, -1}, {0, 0, 0}}};
  for (const auto& [u, v] : spans) {
    for (const double shift : {0.0, 1.0, 5.0}) {  // the origin amid the points, beside, far off
      for (int run = 0; run < 60; ++run) {
        std::vector<Point> points;
        for (int k = 0; k < 1 + run % 15; ++k) {
          const double s = whole(2) + shift, t = whole(1 + run % 3);
          if (s * u + t * v != Eigen::Vector3d::Zero()) points.emplace_back(s * u + t * v);
        }
        check(points);
      }
    }
  }
}

TEST_CASE("flat_hull_vertices: few points, and points at one place") {
  using Indices = std::vector<std::size_t>;
  CHECK(hpr::flat_hull_vertices({}).empty());
  CHECK(hpr::flat_hull_vertices(std::vector<Point>{{1, 2, 3}}) == Indices{0});
  CHECK(hpr::flat_hull_vertices(std::vector<Point>{{1, 2, 3}, {2, 4, 6}, {2, 4, 6}}) ==
        Indices{1, 2});
  check({{1, 0, 0}, {0, 1, 0}, {0.5, 0.5, 0}, {0.5, 0.5, 0}});
  check({{1, 0, 0}, {0, 1, 0}, {0.75, 0.75, 0}, {0.75, 0.75, 0}, {0.25, 0, 0}});
}

}  // namespace
}  // namespace vantage::test
