#include <doctest/doctest.h>
#include <tbb/global_control.h>

#include <algorithm>
#include <limits>
#include <map>
#include <numeric>
#include <random>
#include <tuple>
#include <utility>

#include "vantage/build/viewpoints.hpp"
#include "vantage/kit/voxel_points.hpp"

using namespace vantage;

namespace {

Result<PointCloud> viewpoints_over_all(PointsView points, const ViewpointParams& params) {
  IndexList all(points.size());
  std::iota(all.begin(), all.end(), 0U);
  return viewpoints_over(points, all, params);
}

}  // namespace

TEST_CASE("Eq. 4: one centroid a voxel, equal to a plain average by hand") {
  std::mt19937 random(3);
  std::uniform_real_distribution<double> u(-20.0, 20.0);
  PointCloud cloud(5000);
  for (Point& p : cloud) p = {u(random), u(random), u(random) / 10};

  std::map<std::array<long, 3>, std::pair<Point, int>> voxels;
  for (const Point& p : cloud) {
    auto& [sum, count] = voxels
                             .try_emplace({std::lround(std::floor(p.z() / 1.5)),
                                           std::lround(std::floor(p.y() / 1.5)),
                                           std::lround(std::floor(p.x() / 1.5))},
                                          Point::Zero(), 0)
                             .first->second;
    sum += p;
    ++count;
  }
  const auto centroids = voxel_centroids(cloud, 1.5);
  REQUIRE(centroids);
  REQUIRE(centroids->size() == voxels.size());
  std::size_t i = 0;
  for (const auto& [key, voxel] : voxels) {
    CHECK(((*centroids)[i++] - voxel.first / voxel.second).norm() < 1e-9);
  }
}

TEST_CASE("Eq. 5: viewpoints stand h_s above the ground's centroids") {
  const PointCloud ground{{0.2, 0.2, 1.0}, {0.4, 0.4, 1.2}, {5.5, 0.5, 1.9}};
  const auto viewpoints = viewpoints_over_all(ground, {.voxel_size = 2.0, .sensor_height = 1.5});
  REQUIRE(viewpoints);
  REQUIRE(viewpoints->size() == 2);
  CHECK(((*viewpoints)[0] - Point(0.3, 0.3, 2.6)).norm() < 1e-12);
  CHECK(((*viewpoints)[1] - Point(5.5, 0.5, 3.4)).norm() < 1e-12);
}

TEST_CASE("viewpoints over indices are those over the points that they name") {
  std::mt19937 random(8);
  std::uniform_real_distribution<double> u(-9.0, 9.0);
  PointCloud map(3000);
  for (Point& p : map) p = {u(random), u(random), u(random)};
  IndexList ground;
  for (std::uint32_t k = 1; k < map.size(); k += 3) ground.push_back(k);
  const ViewpointParams params{.voxel_size = 0.7, .sensor_height = 1.5};
  CHECK(viewpoints_over(map, ground, params).value() ==
        viewpoints_over_all(select(map, ground), params).value());
  CHECK(viewpoints_over(map, IndexList{}, params)->empty());
}

TEST_CASE("point order and a far origin change nothing but the last digits") {
  std::mt19937 random(4);
  std::uniform_real_distribution<double> u(0.0, 8.0);
  PointCloud cloud(2000);
  for (Point& p : cloud) p = {u(random), u(random), u(random)};
  const auto expected = voxel_centroids(cloud, 0.5);
  REQUIRE(expected);

  PointCloud shuffled = cloud;
  std::shuffle(shuffled.begin(), shuffled.end(), random);
  const auto again = voxel_centroids(shuffled, 0.5);
  const Point far(1e6, 5e6, 0);
  for (Point& p : cloud) p += far;
  const auto shifted = voxel_centroids(cloud, 0.5);
  REQUIRE(again);
  REQUIRE(shifted);
  REQUIRE(again->size() == expected->size());
  REQUIRE(shifted->size() == expected->size());
  for (std::size_t i = 0; i < expected->size(); ++i) {
    CHECK(((*again)[i] - (*expected)[i]).norm() < 1e-12);
    CHECK(((*shifted)[i] - far - (*expected)[i]).norm() < 2e-9);
  }
}

TEST_CASE("degenerate input: nothing, one point, not finite, too far, no voxel size") {
  CHECK(voxel_centroids({}, 1.0)->empty());
  CHECK(voxel_centroids(PointCloud{{1, 2, 3}}, 1.0)->size() == 1);
  const double nan = std::numeric_limits<double>::quiet_NaN();
  const double inf = std::numeric_limits<double>::infinity();
  for (const Point& bad : {Point(nan, 0, 0), Point(0, nan, 0), Point(0, 0, nan), Point(0, inf, 0),
                           Point(0, 0, 1e300)}) {
    CHECK(voxel_centroids(PointCloud{bad}, 1.0).error().code == ErrorCode::invalid_input);
  }
  for (const double size : {0.0, -1.0, nan, inf}) {
    CHECK(voxel_centroids(PointCloud{{0, 0, 0}}, size).error().code == ErrorCode::invalid_input);
  }
}

TEST_CASE("sensors at several heights: every place again at each, the first height first") {
  const PointCloud ground{{0.2, 0.2, 1.0}, {5.5, 0.5, 2.0}};
  const ViewpointParams params{
      .voxel_size = 2.0, .sensor_height = 1.0, .height_offsets = {0.0, -0.5, 0.8}};
  const auto viewpoints = viewpoints_over_all(ground, params);
  REQUIRE(viewpoints);
  const PointCloud expected{{0.2, 0.2, 2.0}, {5.5, 0.5, 3.0}, {0.2, 0.2, 1.5},
                            {5.5, 0.5, 2.5}, {0.2, 0.2, 2.8}, {5.5, 0.5, 3.8}};
  REQUIRE(viewpoints->size() == expected.size());
  for (std::size_t i = 0; i < expected.size(); ++i) {
    CHECK(((*viewpoints)[i] - expected[i]).norm() < 1e-12);
  }
}

namespace {

ViewpointParams driven(double voxel_size, std::vector<double> lateral_offsets = {0.0}) {
  return {.source = ViewpointSource::trajectory,
          .voxel_size = voxel_size,
          .lateral_offsets = std::move(lateral_offsets)};
}

/// A drive of `length` m to the east and as far to the north, a position every 0.1 m.
PointCloud corner(double length) {
  PointCloud path;
  const int steps = static_cast<int>(length * 10);
  for (int k = 0; k <= steps; ++k) path.push_back({0.1 * k, 0.0, 1.7});
  for (int k = 1; k <= steps; ++k) path.push_back({length, 0.1 * k, 1.7});
  return path;
}

}  // namespace

TEST_CASE(
    "viewpoints along a trajectory are positions of it, one a voxel, the nearest to its centre") {
  const PointCloud path = corner(20.0);
  const auto places = places_along(path, driven(2.0));
  REQUIRE(places);
  CHECK(*places == path);
  const auto viewpoints = viewpoints_over_all(*places, driven(2.0));
  REQUIRE(viewpoints);
  // By hand: the path enters 10 voxels to the east, and 10 more to the north and one at its end.
  std::map<std::array<double, 3>, Point> nearest;
  for (const Point& p : path) {
    const Point voxel = (p / 2.0).array().floor();
    const auto off = [&](const Point& q) { return (q - 2.0 * voxel - Point(1, 1, 1)).norm(); };
    const auto [at, is_new] = nearest.try_emplace({voxel.x(), voxel.y(), voxel.z()}, p);
    if (!is_new && off(p) < off(at->second)) at->second = p;
  }
  CHECK(viewpoints->size() == nearest.size());
  CHECK(viewpoints->size() == 21);
  for (const Point& q : *viewpoints) {
    const Point voxel = (q / 2.0).array().floor();
    CHECK(nearest.at({voxel.x(), voxel.y(), voxel.z()}) == q);
  }
}

TEST_CASE("lateral offsets lie to the left of the direction of travel, at the height of the path") {
  const auto places = places_along(corner(20.0), driven(2.0, {0.0, 1.5, -1.5}));
  REQUIRE(places);
  const std::size_t n = corner(20.0).size();
  REQUIRE(places->size() == 3 * n);
  CHECK(((*places)[n + 50] - Point(5.0, 1.5, 1.7)).norm() < 1e-9);
  CHECK(((*places)[2 * n + 50] - Point(5.0, -1.5, 1.7)).norm() < 1e-9);
  CHECK(((*places)[n + 300] - Point(18.5, 10.0, 1.7)).norm() < 1e-9);
  CHECK(((*places)[2 * n + 300] - Point(21.5, 10.0, 1.7)).norm() < 1e-9);
  for (std::size_t k = 0; k < n; ++k) {  // in the bend, too
    CHECK(((*places)[n + k] - (*places)[k]).norm() == doctest::Approx(1.5));
  }
  SUBCASE("there and back: left is where the other lane's right is") {
    PointCloud back;
    for (int k = 0; k <= 100; ++k) back.push_back({0.1 * k, 0.0, 0.0});
    for (int k = 100; k >= 0; --k) back.push_back({0.1 * k, 0.0, 0.0});
    const auto beside = places_along(back, driven(2.0, {1.0})).value();
    CHECK(beside[30].y() == doctest::Approx(1.0));
    CHECK(beside[160].y() == doctest::Approx(-1.0));
    for (const Point& p : beside) CHECK(p.allFinite());
  }
  SUBCASE("noise of a sensor that stands still is no direction") {
    std::mt19937 random(5);
    std::normal_distribution<double> noise(0.0, 0.02);
    PointCloud waits;
    for (int k = 0; k < 500; ++k) waits.push_back({noise(random), noise(random), 0.0});
    for (int k = 1; k <= 100; ++k) waits.push_back({0.1 * k, noise(random), 0.0});
    const auto beside = places_along(waits, driven(2.0, {2.0})).value();
    for (std::size_t k = 0; k < beside.size(); ++k) {
      CHECK(beside[k].y() - waits[k].y() > 1.9);
    }
  }
}

TEST_CASE("heights above a trajectory are above the sensor, and h_s is not added") {
  ViewpointParams params = driven(1.0);
  params.height_offsets = {0.0, 0.5};
  const auto viewpoints = viewpoints_over_all(PointCloud{{0.5, 0.5, 1.7}}, params).value();
  CHECK(viewpoints == PointCloud{{0.5, 0.5, 1.7}, {0.5, 0.5, 2.2}});
}

TEST_CASE("a trajectory that cannot be used is refused: none, not finite, without a direction") {
  const double nan = std::numeric_limits<double>::quiet_NaN();
  CHECK(places_along({}, driven(1.0)).error().message == "the trajectory has no points");
  CHECK(places_along(PointCloud{{0, nan, 0}}, driven(1.0)).error().code ==
        ErrorCode::invalid_input);
  const PointCloud still(3, Point(1, 2, 3));
  CHECK(places_along(still, driven(1.0)).value() == still);
  CHECK(places_along(still, driven(1.0, {0.0, 1.0})).error().code == ErrorCode::invalid_input);
}

namespace {

/// A street of 40 x 10 m at z = 0, a roof of 20 x 10 m at z = 3 over its south side, and an island
/// of 5 x 5 m at z = 0 to the north, 4 m away; a point every half metre.
struct Town {
  PointCloud map;
  IndexList street, roof, island, all;

  Town() {
    add(street, 40, 10, {0, 0, 0});
    add(roof, 20, 10, {0, -10, 3});
    add(island, 5, 5, {10, 14, 0});
    for (std::uint32_t k = 0; k < map.size(); ++k) all.push_back(k);
  }
  void add(IndexList& part, double length, double width, const Point& corner) {
    for (double x = 0.25; x < length; x += 0.5) {
      for (double y = 0.25; y < width; y += 0.5) {
        part.push_back(static_cast<std::uint32_t>(map.size()));
        map.push_back(corner + Point(x, y, 0.0));
      }
    }
  }
  [[nodiscard]] IndexList reachable(PointsView trajectory = {}, double max_step = 0.3) const {
    return reachable_ground(map, all, trajectory, max_step).value();
  }
};

}  // namespace

TEST_CASE("reachable ground: the largest, or what the trajectory is above; no roofs and islands") {
  const Town town;
  CHECK(town.reachable() == town.street);
  CHECK(town.reachable(PointCloud{{5, -5, 4.5}}) == town.roof);
  CHECK(town.reachable(PointCloud{{12, 16, 1.0}}) == town.island);
  const PointCloud both{{12, 16, 1.0}, {5, 5, 1.0}, {500, 500, 1.0}};
  IndexList expected = town.street;
  expected.insert(expected.end(), town.island.begin(), town.island.end());
  CHECK(town.reachable(both) == expected);
  CHECK(town.reachable({}, 3.1).size() == town.street.size() + town.roof.size());
  CHECK(reachable_ground(town.map, town.all, PointCloud{{500, 500, 1}}, 0.3).error().code ==
        ErrorCode::invalid_input);
  CHECK(reachable_ground(town.map, town.all, PointCloud{{5, 5, -1}}, 0.3).error().code ==
        ErrorCode::invalid_input);
}

TEST_CASE("reachable ground: ramps lead up, holes of a metre are crossed, ditches of two are not") {
  PointCloud map;
  const auto strip = [&](double from, double to, double slope, double z) {
    for (double x = from + 0.25; x < to; x += 0.5) {
      for (double y = 0.25; y < 4; y += 0.5) map.push_back({x, y, z + slope * (x - from)});
    }
  };
  strip(0, 20, 0.0, 0.0);
  strip(20, 40, 0.2, 0.0);  // up to 4 m
  strip(40, 60, 0.0, 4.0);
  const auto count = [&] {
    IndexList all(map.size());
    for (std::uint32_t k = 0; k < map.size(); ++k) all[k] = k;
    return reachable_ground(map, all, PointCloud{{1, 1, 1}}, 0.3).value().size();
  };
  CHECK(count() == map.size());
  strip(61, 70, 0.0, 4.0);
  CHECK(count() == map.size());
  const std::size_t before = map.size();
  strip(72, 80, 0.0, 4.0);
  CHECK(count() == before);
}

TEST_CASE("reachable ground: a step within a square metre and between two of them stops a robot") {
  for (const double edge : {10.0, 10.5}) {
    PointCloud map;
    for (double x = 0.25; x < 30; x += 0.5) {
      for (double y = 0.25; y < 6; y += 0.5) map.push_back({x, y, x < edge ? 0.0 : 0.8});
    }
    IndexList all(map.size()), low;
    for (std::uint32_t k = 0; k < map.size(); ++k) {
      all[k] = k;
      if (map[k].z() == 0.0) low.push_back(k);
    }
    CHECK(reachable_ground(map, all, PointCloud{{1, 1, 1}}, 0.3).value() == low);
  }
}

TEST_CASE("reachable ground does not depend on the order of points or the number of threads") {
  std::mt19937 random(11);
  std::uniform_real_distribution<double> u(0.0, 60.0), height(0.0, 1.0);
  PointCloud map(4000);
  for (Point& p : map) p = {u(random), u(random), height(random)};
  IndexList all(map.size());
  for (std::uint32_t k = 0; k < map.size(); ++k) all[k] = k;
  const auto chosen = [&](const PointCloud& cloud) {
    PointCloud points = select(cloud, reachable_ground(cloud, all, {}, 0.2).value());
    std::sort(points.begin(), points.end(), [](const Point& a, const Point& b) {
      return std::tuple(a.x(), a.y(), a.z()) < std::tuple(b.x(), b.y(), b.z());
    });
    return points;
  };
  const PointCloud expected = chosen(map);
  CHECK(expected.size() > 100);
  CHECK(expected.size() < map.size());
  for (const std::size_t threads : {1U, 2U}) {
    const tbb::global_control limit(tbb::global_control::max_allowed_parallelism, threads);
    std::shuffle(map.begin(), map.end(), random);
    CHECK(chosen(map) == expected);
  }
}

TEST_CASE("reachable ground, degenerate: none, one point, not finite, too far") {
  CHECK(reachable_ground({}, IndexList{}, {}, 0.3)->empty());
  CHECK(reachable_ground(PointCloud{{1, 2, 3}}, IndexList{0}, {}, 0.3).value() == IndexList{0});
  const double nan = std::numeric_limits<double>::quiet_NaN();
  for (const Point& bad : {Point(nan, 0, 0), Point(0, 0, nan), Point(1e300, 0, 0)}) {
    CHECK(reachable_ground(PointCloud{bad}, IndexList{0}, {}, 0.3).error().code ==
          ErrorCode::invalid_input);
  }
}
