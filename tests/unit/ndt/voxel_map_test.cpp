#include <doctest/doctest.h>
#include <Eigen/Eigenvalues>
#include <Eigen/LU>
#include <algorithm>
#include <array>
#include <limits>
#include <map>
#include <random>
#include <set>
#include <vector>

#include "scenes.hpp"
#include "voxel_map.hpp"

namespace vantage::ndt {
namespace {

/// In metres.
Point mean_of(const VoxelMap& map, std::size_t i) {
  return map.origin() + map.options().resolution *
                            (VoxelMap::corner_of(map.keys()[i]) + gaussian_of(map.cells()[i]).mean);
}

Eigen::Matrix3d inverse_covariance(const VoxelMap& map, std::size_t i) {
  const Gaussian g = gaussian_of(map.cells()[i]);
  Eigen::Matrix3d c;
  c << g.xx, g.xy, g.xz, g.xy, g.yy, g.yz, g.xz, g.yz, g.zz;
  return c / (map.options().resolution * map.options().resolution);
}

/// Points in a box, on a plane of the given thickness.
PointCloud slab(const Point& centre, double thickness, int points) {
  std::mt19937 random(7);
  std::uniform_real_distribution<double> unit(-0.4, 0.4);
  PointCloud cloud;
  for (int i = 0; i < points; ++i) {
    cloud.push_back(centre + Point(unit(random), unit(random), thickness / 0.8 * unit(random)));
  }
  return cloud;
}

std::array<double, 3> voxel_of(const Point& p, double resolution) {
  const Eigen::Vector3d v = (p / resolution).array().floor();
  return {v.x(), v.y(), v.z()};
}

}  // namespace

TEST_CASE("a voxel's Gaussian is the mean and the inverse sample covariance of its points") {
  const PointCloud cloud = slab({3.5, -2.5, 0.5}, 0.7, 200);
  const auto map = VoxelMap::build(cloud, {.resolution = 1.0, .eigenvalue_floor = 1e-6});
  REQUIRE(map);
  REQUIRE(map->cells().size() == 1);
  CHECK(map->cells()[0].points == 200);

  Eigen::Vector3d mean = Eigen::Vector3d::Zero();
  for (const Point& p : cloud) mean += p / 200.0;
  Eigen::Matrix3d covariance = Eigen::Matrix3d::Zero();
  for (const Point& p : cloud) covariance += (p - mean) * (p - mean).transpose() / 199.0;
  CHECK((mean_of(*map, 0) - mean).norm() < 2e-5);
  CHECK((inverse_covariance(*map, 0) * covariance).isIdentity(1e-3));
}

TEST_CASE("no eigenvalue of a covariance is below its share of the largest") {
  for (const double floor : {0.001, 0.01, 0.3, 1.0}) {
    CAPTURE(floor);
    const auto map = VoxelMap::build(slab({0.5, 0.5, 0.5}, 0.0, 300), {.eigenvalue_floor = floor});
    REQUIRE(map);
    const Eigen::SelfAdjointEigenSolver<Eigen::Matrix3d> solver(inverse_covariance(*map, 0));
    // Of the inverse: the largest belongs to the smallest.
    CHECK(solver.eigenvalues()[0] / solver.eigenvalues()[2] ==
          doctest::Approx(floor).epsilon(3e-3));
  }
}

TEST_CASE("a voxel needs min_points distinct points") {
  PointCloud cloud = slab({0.5, 0.5, 0.5}, 0.5, 5);
  const auto five = VoxelMap::build(cloud, {.min_points = 6});
  REQUIRE(!five);
  CHECK(five.error().code == ErrorCode::too_few_matches);
  cloud.push_back({0.5, 0.5, 0.5});
  CHECK(VoxelMap::build(cloud, {.min_points = 6}));
  CHECK(VoxelMap::build(cloud, {.min_points = 7}).error().code == ErrorCode::too_few_matches);

  const auto coincident = VoxelMap::build(PointCloud(50, Point(0.3, 0.3, 0.3)), {});
  REQUIRE(!coincident);
  CHECK(coincident.error().code == ErrorCode::too_few_matches);
  CHECK(coincident.error().message.find("sparse") != std::string::npos);
}

TEST_CASE("every voxel with enough points is found, and no other") {
  const PointCloud cloud = test::yard(1);
  for (const double resolution : {0.3, 1.0, 7.0}) {
    CAPTURE(resolution);
    std::map<std::array<double, 3>, std::uint32_t> expected;
    for (const Point& p : cloud) ++expected[voxel_of(p, resolution)];
    const auto map = VoxelMap::build(cloud, {.resolution = resolution});
    REQUIRE(map);
    std::size_t found = 0, wrong = 0;
    for (const auto& [voxel, points] : expected) {
      const Point centre = (Point(voxel[0], voxel[1], voxel[2]).array() + 0.5) * resolution;
      const auto gaussian = map->find(map->key_of(centre));
      if ((gaussian != kNoGaussian) != (points >= 6)) ++wrong;
      if (gaussian == kNoGaussian) continue;
      ++found;
      if (map->cells()[gaussian].points != points) ++wrong;
      if (voxel_of(mean_of(*map, gaussian), resolution) != voxel) ++wrong;
    }
    CHECK(wrong == 0);
    CHECK(found == map->cells().size());
  }
}

TEST_CASE("voxels are anchored at the world's zero: a part of a map has the voxels of the whole") {
  PointCloud cloud = test::yard(2);
  for (int i = 0; i < 20; ++i) cloud.emplace_back(-3.0 + 0.001 * i, 4.0, 0.002 * i);  // on edges
  PointCloud part;
  for (const Point& p : cloud) {
    if (p.x() >= -4.0 && p.x() < 9.0) part.push_back(p);  // whole voxels
  }
  const auto whole = VoxelMap::build(cloud, {});
  const auto half = VoxelMap::build(part, {});
  REQUIRE(whole);
  REQUIRE(half);
  REQUIRE(whole->origin() != half->origin());
  CHECK(half->cells().size() > 300);
  std::size_t wrong = 0;
  for (std::size_t i = 0; i < half->cells().size(); ++i) {
    const auto same = whole->find(whole->key_of(mean_of(*half, i)));
    wrong += same == kNoGaussian || whole->cells()[same] != half->cells()[i] ? 1U : 0U;
  }
  CHECK(wrong == 0);
}

TEST_CASE("the order of the points does not matter") {
  PointCloud cloud = test::yard(3);
  const auto map = VoxelMap::build(cloud, {});
  std::shuffle(cloud.begin(), cloud.end(), std::mt19937(5));
  const auto shuffled = VoxelMap::build(cloud, {});
  REQUIRE(map);
  REQUIRE(shuffled);
  REQUIRE(map->cells().size() == shuffled->cells().size());
  CHECK(std::ranges::equal(map->keys(), shuffled->keys()));
  double worst = 0.0;
  for (std::size_t i = 0; i < map->cells().size(); ++i) {
    CHECK(map->cells()[i].points == shuffled->cells()[i].points);
    worst = std::max(worst, (mean_of(*map, i) - mean_of(*shuffled, i)).norm());
  }
  CHECK(worst < 3e-5);  // a step of the mean
}

TEST_CASE("a map far from zero has the Gaussians of the same map at zero") {
  PointCloud cloud = test::yard(4);
  // Coordinates that stay exact when shifted, so that points on edges stay where they are.
  for (Point& p : cloud) p = (p * 4096.0).array().round() / 4096.0;
  for (const double resolution : {0.5, 1.0, 2.0}) {
    const auto near = VoxelMap::build(cloud, {.resolution = resolution});
    const Eigen::Vector3d by(1e6, -5e6, 3000.0);
    const auto far = VoxelMap::build(test::shifted(cloud, by), {.resolution = resolution});
    REQUIRE(near);
    REQUIRE(far);
    CHECK(far->origin() - near->origin() == by);
    CHECK(std::ranges::equal(far->keys(), near->keys()));
    CHECK(std::ranges::equal(far->cells(), near->cells()));
  }
}

TEST_CASE("bad maps are errors") {
  CHECK(VoxelMap::build({}, {}).error().code == ErrorCode::invalid_input);
  PointCloud cloud = slab({0.5, 0.5, 0.5}, 0.5, 20);
  for (const double bad :
       {std::numeric_limits<double>::quiet_NaN(), std::numeric_limits<double>::infinity()}) {
    cloud.back().y() = bad;
    CHECK(VoxelMap::build(cloud, {}).error().code == ErrorCode::invalid_input);
  }
  for (const double far : {3e6, 1e30, std::numeric_limits<double>::max()}) {
    cloud.back() = Point(0.5, far, 0.5);
    const auto wide = VoxelMap::build(cloud, {});
    REQUIRE(!wide);
    CHECK(wide.error().code == ErrorCode::invalid_input);
  }
}

TEST_CASE("the error of a map that is too wide names the point that is far off") {
  PointCloud map = slab({0.5, 0.5, 0.5}, 0.5, 20);
  map[7] = {3.0, 1e9, 2.5};
  const auto wide = VoxelMap::build(map, {});
  REQUIRE(!wide);
  CHECK(wide.error().message ==
        "the map spans more than two million voxels of 1 m: its farthest point is number 7, at (3, "
        "1e+09, 2.5) m");
}

TEST_CASE("places that the map cannot reach have no voxel") {
  const auto map = VoxelMap::build(slab({0.5, 0.5, 0.5}, 0.5, 20), {});
  REQUIRE(map);
  constexpr double inf = std::numeric_limits<double>::infinity();
  for (const double far :
       {1.1e6, -1.1e6, 1e18, -1e300, inf, -inf, std::numeric_limits<double>::quiet_NaN()}) {
    CAPTURE(far);
    for (Eigen::Index axis = 0; axis < 3; ++axis) {
      Eigen::Vector3d p(0.5, 0.5, 0.5);
      p[axis] = far;
      CHECK(map->key_of(p) == kNoVoxel);
    }
  }
  // Next to the end of the range is still a voxel, without a Gaussian.
  const VoxelKey last = map->key_of({0.5, (1 << 20) - 1.5, 0.5});
  REQUIRE(last != kNoVoxel);
  CHECK(map->find(last) == kNoGaussian);
}

TEST_CASE("a key's corner is its voxel's") {
  const auto map = VoxelMap::build(slab({0.5, 0.5, 0.5}, 0.5, 20), {});
  REQUIRE(map);
  std::mt19937 random(1);
  std::uniform_int_distribution<int> index(-1000000, 1000000);
  for (int i = 0; i < 1000; ++i) {
    const Eigen::Vector3d corner(index(random), index(random), index(random));
    const VoxelKey key = map->key_of(map->origin() + corner + Eigen::Vector3d(0.3, 0.6, 0.9));
    CHECK(VoxelMap::corner_of(key) == corner);
  }
}

}  // namespace vantage::ndt
