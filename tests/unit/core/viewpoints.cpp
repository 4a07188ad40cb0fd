#include <doctest/doctest.h>

#include <algorithm>
#include <limits>
#include <map>
#include <random>

#include "vantage/viewpoints.hpp"

using namespace vantage;

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
  const auto viewpoints = viewpoints_over(ground, {.voxel_size = 2.0, .sensor_height = 1.5});
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
        viewpoints_over(select(map, ground), params).value());
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
  for (const Point& bad : {Point(nan, 0, 0), Point(0, inf, 0), Point(0, 0, 1e300)}) {
    CHECK(voxel_centroids(PointCloud{bad}, 1.0).error().code == ErrorCode::invalid_input);
  }
  for (const double size : {0.0, -1.0, nan, inf}) {
    CHECK(voxel_centroids(PointCloud{{0, 0, 0}}, size).error().code == ErrorCode::invalid_input);
  }
}
