#include "view/thinning.hpp"

#include <doctest/doctest.h>

#include <algorithm>
#include <random>

using namespace vantage;
using namespace vantage::view;

namespace {

const Bounds3 kBounds{{0, 0, 0}, {100, 100, 10}};

PointCloud scattered(std::size_t count) {
  std::mt19937 random(3);
  const auto uniform = [&](double high) {
    return high * (static_cast<double>(random()) / 4294967296.0);
  };
  PointCloud points;
  for (std::size_t i = 0; i < count; ++i)
    points.emplace_back(uniform(100), uniform(100), uniform(10));
  return points;
}

auto less = [](const Point& a, const Point& b) {
  return std::lexicographical_compare(a.begin(), a.end(), b.begin(), b.end());
};

}  // namespace

TEST_CASE("a place of several maps is there once, with the number of maps") {
  PointTable table(kBounds, 100);
  table.add(PointCloud{{1, 1, 1}, {2, 2, 2}, {2.001, 2, 2}});
  table.add(PointCloud{{1.000005, 1, 1}, {3, 3, 3}});
  CHECK(table.points().size() == 3);
  CHECK(table.views() == std::vector<std::uint32_t>{2, 1, 1});
  CHECK(table.views_at({1, 1, 1.002}) == 2);
  CHECK(table.views_at({9, 9, 9}) == 0);
  CHECK_FALSE(table.thinned());
}

TEST_CASE("views of maps add up, and of one map the most at a place count") {
  PointTable table(kBounds, 100);
  const std::vector<std::uint32_t> first{5, 2, 9}, second{3, 1};
  table.add(PointCloud{{1, 1, 1}, {2, 2, 2}, {2.001, 2, 2}}, first);
  table.add(PointCloud{{2, 2, 2}, {3, 3, 3}}, second);
  CHECK(table.views() == std::vector<std::uint32_t>{5, 12, 1});
}

TEST_CASE("no more than the limit are kept, and more than half of it") {
  PointTable table(kBounds, 1000);
  table.add(scattered(50'000));
  CHECK(table.thinned());
  CHECK(table.points().size() <= 1000);
  CHECK(table.points().size() > 600);
}

TEST_CASE("which places are kept does not depend on the order, and counts stay whole") {
  PointCloud points = scattered(5000);
  PointTable forth(kBounds, 700);
  forth.add(points);
  forth.add(points);
  std::reverse(points.begin(), points.end());
  PointTable back(kBounds, 700);
  back.add(points);
  back.add(points);
  PointCloud a = forth.points(), b = back.points();
  std::sort(a.begin(), a.end(), less);
  std::sort(b.begin(), b.end(), less);
  CHECK(a == b);
  for (const std::uint32_t views : forth.views()) CHECK(views == 2);
}

TEST_CASE("places are a centimetre, more only where the map is wider than ten kilometres") {
  CHECK(PointTable(kBounds, 1).cell_size() == 0.01);
  CHECK(PointTable({{0, 0, 0}, {1e5, 1, 1}}, 1).cell_size() ==
        doctest::Approx(0.0954).epsilon(0.01));
  PointTable none(Bounds3{}, 10);
  none.add({});
  CHECK(none.points().empty());
}
