#include "export/union.hpp"

#include <doctest/doctest.h>

#include <algorithm>
#include <cmath>
#include <random>
#include <vector>

namespace vantage {
namespace {

using exporting::UnionOfMaps;

RegionMap of_points(PointCloud points) {
  return {.points = std::move(points), .viewpoints = {}, .prepared = {}};
}

/// As pcd_tiles keeps points: float32 around a whole metre.
RegionMap stored(PointsView points, const Point& origin) {
  std::vector<Eigen::Vector3f> kept;
  for (const Point& p : points) kept.push_back((p - origin).cast<float>());
  RegionMap map = of_points({});
  for (const Eigen::Vector3f& p : kept) map.points.push_back(p.cast<double>() + origin);
  return map;
}

PointCloud random_cloud(std::size_t count, const Point& middle) {
  std::mt19937 random(11);
  const auto uniform = [&] { return 100.0 * static_cast<double>(random()) / 4294967296.0; };
  PointCloud cloud;
  for (std::size_t i = 0; i < count; ++i) {
    const double x = uniform(), y = uniform(), z = uniform() / 10;
    cloud.push_back(middle + Point(x, y, z));
  }
  return cloud;
}

TEST_CASE("union: nothing, and the same points twice") {
  UnionOfMaps all;
  all.add(of_points({}));
  CHECK(all.points().empty());
  UnionOfMaps apart;
  for (const double x : {0.0, 0.001, 0.002}) {
    apart.add(of_points({}));
    apart.add(of_points({{x, 0, 0}}));
  }
  CHECK(apart.points().size() == 3);
  const PointCloud two{{1, 2, 3}, {-0.0, 0.0, 1e300}};
  all.add(of_points(two));
  all.add(of_points(two));
  CHECK(all.points() == two);
  CHECK(all.repeated() == 2);
  all.add(of_points({{1, 2, 3}, {1, 2, 3}, {0.0, 0.0, 1e300}}));  // 0 is -0
  CHECK(all.points().size() == 2);
  CHECK(all.repeated() == 5);
}

TEST_CASE("union: points that a store rounds around different origins are one") {
  for (const Point& middle : {Point(0, 0, 0), Point(500'000, 4'649'776, 430)}) {
    const PointCloud cloud = random_cloud(100'000, middle);
    UnionOfMaps all;
    std::size_t different = 0;
    for (int map = 0; map < 5; ++map) {
      const RegionMap region = stored(cloud, middle + Point(10.0 * map, 70.0 - 3.0 * map, map));
      for (std::size_t i = 0; i < cloud.size() && map > 0; ++i) {
        different += region.points[i] != all.points()[i] ? 1 : 0;
      }
      all.add(region);
    }
    CHECK(different > 100'000);  // or the test shows nothing
    CHECK(all.points().size() == cloud.size());
    CHECK(all.repeated() == 4 * cloud.size());
    for (std::size_t i = 0; i < cloud.size(); ++i) {
      if ((all.points()[i] - cloud[i]).norm() < 1e-4) continue;
      FAIL("the order is that of the first map");
    }
  }
}

TEST_CASE("union: across the borders of cells") {
  PointCloud cloud;
  for (int i = 0; i < 1000; ++i) cloud.push_back({i / 256.0, -i / 256.0, i % 7 / 256.0});
  PointCloud moved;
  for (const Point& p : cloud) moved.push_back(p + Point(-1e-7, 1e-7, -1e-7));
  for (const bool forth : {true, false}) {
    UnionOfMaps all;
    all.add(of_points(forth ? cloud : moved));
    all.add(of_points(forth ? moved : cloud));
    CHECK(all.points().size() == cloud.size());
  }
}

TEST_CASE("union: neighbours stay as many as they are in one map") {
  const PointCloud close{{0, 0, 0}, {1e-7, 0, 0}, {2e-7, 0, 0}};
  UnionOfMaps all;
  all.add(of_points(close));
  CHECK(all.points().size() == 3);
  PointCloud moved;
  for (const Point& p : close) moved.push_back(p + Point(0.4e-7, 0, 0));
  all.add(of_points(moved));
  CHECK(all.points().size() == 3);
  all.add(of_points({{1e-3, 0, 0}, {-1e-3, 0, 0}}));  // too far to be one of them
  CHECK(all.points().size() == 5);
}

TEST_CASE("union: the same as sets say, whatever the overlap") {
  const PointCloud cloud = random_cloud(20'000, {0, 0, 0});
  UnionOfMaps all;
  std::size_t given = 0;
  for (std::size_t map = 0; map < 9; ++map) {
    RegionMap region = of_points({});
    for (std::size_t i = map; i < cloud.size(); i += map + 1) region.points.push_back(cloud[i]);
    given += region.points.size();
    all.add(region);
  }
  CHECK(all.points() == cloud);  // the first map had them all
  CHECK(all.repeated() == given - cloud.size());
}

}  // namespace
}  // namespace vantage
