#include <doctest/doctest.h>

#include <cmath>
#include <future>
#include <limits>
#include <numeric>
#include <vector>

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

/// V_ij by its definition: every point against every viewpoint.
IndexList within_range(PointsView map, PointsView viewpoints, double range) {
  IndexList seen;
  for (std::uint32_t i = 0; i < map.size(); ++i) {
    for (const Point& viewpoint : viewpoints) {
      if (map[i] != viewpoint && (map[i] - viewpoint).norm() <= range) {
        seen.push_back(i);
        break;
      }
    }
  }
  return seen;
}

TEST_CASE("keep_all keeps what brute force keeps, bit for bit") {
  const auto keep_all = plugin<VisibilityOperator>("keep_all");
  const auto check = [&](PointsView map, PointsView viewpoints, double range) {
    const auto scene = keep_all->prepare(map, {.map_bounds = bounds_of(map), .max_range = range});
    REQUIRE(scene);
    const IndexList expected = within_range(map, viewpoints, range);
    CHECK((*scene)->visible_from_any(viewpoints) == expected);
    return expected.size();
  };

  SUBCASE("clouds of any extent, near the origin and far from it, for few and many viewpoints") {
    for (const Point& centre :
         {Point(0, 0, 0), Point(-70, 13, -40), Point(4.5e5, -5.6e6, 120), Point(1e9, 1e9, -1e9)}) {
      CAPTURE(centre.transpose());
      std::size_t some = 0;
      for (const std::uint32_t seed : {1U, 2U, 3U}) {
        const PointCloud map = ball(seed, 4000, 40.0, 0.0, centre);
        for (const std::size_t count : {1U, 2U, 30U}) {
          const PointCloud viewpoints = ball(seed + 10, count, 25.0, 0.0, centre);
          for (const double range : {0.01, 3.0, 10.0, 20.0, 35.0, 60.0, 500.0}) {
            CAPTURE(range);
            const std::size_t kept = check(map, viewpoints, range);
            some += kept > 0 && kept < map.size();
          }
        }
      }
      CHECK(some > 20);  // not all or nothing only
    }
  }
  SUBCASE("viewpoints that are points of the map, once, twice and among others") {
    const PointCloud map = joined(ball(4, 3000, 15.0), ball(4, 3000, 15.0));  // every point twice
    for (const double range : {0.5, 6.0, 40.0}) {
      check(map, PointCloud{map[17]}, range);
      check(map, PointCloud{map[17], map[17]}, range);
      check(map, PointCloud{map[17], map[18], {3, 2, 1}}, range);
      check(map, PointCloud(map.begin(), map.begin() + 50), range);
    }
    CHECK(check(map, PointCloud{map[17]}, 40.0) == map.size() - 2);
    CHECK(check(map, PointCloud{map[17], map[18]}, 40.0) == map.size());
  }
  SUBCASE("points exactly at the range, and a bit beyond it") {
    // Cells, points and ranges are multiples of one another: everything lies on an edge.
    const PointCloud map = joined(lattice(9, 1.0), lattice(9, 0.7));
    for (const double range : {1.0, 2.0, 0.7 * 5, 7.0, 13.0}) {
      for (const double r : {std::nextafter(range, 0.0), range, std::nextafter(range, 99.0)}) {
        check(map, PointCloud{Point::Zero()}, r);
        check(map, PointCloud{{2, 0, 0}, {-3, 4, 0}, {0.7, -0.7, 20}}, r);
      }
    }
    // The range is a point's own distance: a cell's farthest point decides for the cell.
    const PointCloud cloud = ball(5, 2000, 30.0, 0.0, {-11, 22, -33});
    const Point viewpoint(-9, 21, -30);
    for (std::size_t i = 0; i < cloud.size(); i += 20) {
      const double distance = (cloud[i] - viewpoint).norm();
      const std::size_t with = check(cloud, PointCloud{viewpoint}, distance);
      CHECK(check(cloud, PointCloud{viewpoint}, std::nextafter(distance, 0.0)) < with);
    }
  }
  SUBCASE("cells of one point each, one point in all, all points at one place") {
    check(ball(6, 500, 5000.0), ball(7, 20, 5000.0), 900.0);
    for (const double range : {1.0, 1.5}) {
      check(PointCloud{{1, 0, 0}}, PointCloud{{2.2, 0, 0}}, range);
      check(PointCloud(100, Point(-1, -1, -1)), PointCloud{{-1, -1, 0.2}}, range);
      check(PointCloud(100, Point(-1, -1, -1)), PointCloud{{-1, -1, -1}}, range);
    }
  }
  SUBCASE("numbers at the ends of double") {
    const PointCloud map{
        {1e308, 0, 0}, {-1e308, 0, 0}, {1e150, 1e150, 0}, {1e-310, 0, 0}, {0, 0, 0}};
    for (const double range : {1e-320, 1.0, 1e150, 2e150, 1e308}) {
      check(map, map, range);
      for (const Point& p : map) check(map, PointCloud{p}, range);
    }
  }
}

TEST_CASE("keep_all answers calls from several threads at once as it answers one") {
  const auto keep_all = plugin<VisibilityOperator>("keep_all");
  const PointCloud map = ball(8, 20000, 40.0);
  const PointCloud viewpoints = ball(9, 40, 30.0);
  const auto scene = keep_all->prepare(map, {.map_bounds = bounds_of(map), .max_range = 12.0});
  REQUIRE(scene);
  const auto answers = [&] {
    std::vector<IndexList> lists;
    for (int i = 0; i < 20; ++i) {
      lists.push_back((*scene)->visible_from_any(viewpoints).value_or(IndexList{}));
    }
    return lists;
  };
  const std::vector<IndexList> expected(20, within_range(map, viewpoints, 12.0));
  auto other = std::async(std::launch::async, answers);
  CHECK(answers() == expected);
  CHECK(other.get() == expected);
}

}  // namespace
}  // namespace vantage::test
