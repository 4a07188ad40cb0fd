#include <doctest/doctest.h>

#include <limits>
#include <numeric>

#include "scenes.hpp"
#include "support/plugins.hpp"
#include "support/reports.hpp"

namespace vantage::test {
namespace {

TEST_CASE("keep_all") {
  const auto keep_all = plugin<VisibilityOperator>("keep_all");
  const PointCloud map = ball(1, 2000, 20.0);
  const Bounds3 bounds = bounds_of(map);
  IndexList everything(map.size());
  std::iota(everything.begin(), everything.end(), 0U);

  SUBCASE("unlimited range: every point but one at the viewpoint") {
    const auto scene = keep_all->prepare(map, {.map_bounds = bounds});
    REQUIRE(scene);
    CHECK((*scene)->visible({100, 200, 300}) == everything);
    IndexList others = everything;
    std::erase(others, 7U);
    CHECK((*scene)->visible(map[7]) == others);
    CHECK((*scene)->visible_from_any(PointCloud{map[7], map[8]}) == everything);
    CHECK((*scene)->visible_from_any({}) == IndexList{});
  }
  SUBCASE("limited range: the points within it") {
    const double range = 6.0;
    const auto scene = keep_all->prepare(map, {.map_bounds = bounds, .max_range = range});
    REQUIRE(scene);
    const PointCloud viewpoints{{15, 0, 0}, {-15, 0, 0}, {0, 12, 3}};
    IndexList any;
    for (std::uint32_t i = 0; i < map.size(); ++i) {
      bool near = false;
      for (const Point& viewpoint : viewpoints) near |= (map[i] - viewpoint).norm() <= range;
      if (near) any.push_back(i);
    }
    CHECK(!any.empty());
    CHECK(any.size() < map.size());
    const Reports reports;
    CHECK((*scene)->visible_from_any(viewpoints, &reports) == any);
    CHECK(reports.viewpoints() == viewpoints.size());
    IndexList one;
    for (std::uint32_t i = 0; i < map.size(); ++i) {
      if ((map[i] - viewpoints[0]).norm() <= range) one.push_back(i);
    }
    CHECK((*scene)->visible(viewpoints[0]) == one);
    CHECK((*scene)->visible({200, 0, 0}) == IndexList{});
  }
  SUBCASE("the range is closed") {
    const PointCloud row{{1, 0, 0}, {2, 0, 0}, {3, 0, 0}};
    const auto scene = keep_all->prepare(row, {.map_bounds = bounds_of(row), .max_range = 2.0});
    REQUIRE(scene);
    CHECK((*scene)->visible(Point::Zero()) == IndexList{0, 1});
  }
  SUBCASE("what is no input is an error") {
    const auto refused = [&](PointsView points, double range) {
      const auto scene = keep_all->prepare(points, {.map_bounds = bounds, .max_range = range});
      return !scene && scene.error().code == ErrorCode::invalid_input;
    };
    constexpr double kNan = std::numeric_limits<double>::quiet_NaN();
    CHECK(refused({}, 1.0));
    CHECK(refused(PointCloud{{kNan, 0, 0}}, 1.0));
    CHECK(refused(map, 0.0));
    CHECK(refused(map, kNan));
    const auto scene = keep_all->prepare(map, {.map_bounds = bounds});
    REQUIRE(scene);
    const auto indices = (*scene)->visible({kNan, 0, 0});
    REQUIRE(!indices);
    CHECK(indices.error().code == ErrorCode::invalid_input);
  }
}

}  // namespace
}  // namespace vantage::test
