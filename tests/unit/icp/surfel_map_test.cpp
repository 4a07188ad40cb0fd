#include "common/surfel_map.hpp"

#include <doctest/doctest.h>
#include <algorithm>
#include <cmath>
#include <limits>
#include <random>

#include "common/surfel_target.hpp"
#include "scenes.hpp"

namespace vantage::matching {
namespace {

PointCloud random_cloud(std::size_t size, const Point& low, const Point& high,
                        std::uint32_t seed = 1) {
  std::mt19937 random(seed);
  PointCloud cloud;
  for (std::size_t i = 0; i < size; ++i) {
    Point p;
    for (const Eigen::Index axis : {0, 1, 2}) {
      p[axis] = std::uniform_real_distribution<double>(low[axis], high[axis])(random);
    }
    cloud.push_back(p);
  }
  return cloud;
}

SurfelMap built(PointsView map, const SurfelMap::Options& options) {
  auto surfels = SurfelMap::build(map, options);
  REQUIRE(surfels);
  return *std::move(surfels);
}

}  // namespace

TEST_CASE("a thinned map holds the centroids of its voxels, any other each point once") {
  PointCloud map = random_cloud(5000, {-3.0, -2.0, -1.0}, {4.0, 2.0, 1.5});
  const PointCloud expected = test::thinned(map, 0.5);
  const SurfelMap thinned = built(map, {.voxel = 0.5});
  REQUIRE(thinned.points().size() == expected.size());
  for (const Point& p : thinned.points()) {
    const Point at = p + thinned.origin();
    CHECK(std::ranges::any_of(expected, [&](const Point& q) { return (q - at).norm() < 1e-12; }));
  }
  CHECK(thinned.bytes() > thinned.points().size() * 48);

  map.insert(map.end(), map.begin(), map.begin() + 1000);
  CHECK(built(map, {.voxel = 0.0}).points().size() == 5000);
}

TEST_CASE("normals are those of the plane about a point, or zero") {
  PointCloud plane = random_cloud(3000, {-5.0, -5.0, 0.0}, {5.0, 5.0, 0.0});
  const Eigen::Vector3d normal = Eigen::Vector3d(0.3, -0.2, 1.0).normalized();
  for (Point& p : plane) p -= normal * normal.dot(p);
  PointCloud all = plane;
  for (int i = 0; i < 200; ++i) all.emplace_back(20.0 + 0.1 * i, 0.0, 0.0);  // a line
  const SurfelMap map = built(all, {.voxel = 0.0});
  std::size_t without = 0;
  for (const Eigen::Vector3d& n : map.normals()) {
    if (n.isZero(0.0)) {
      ++without;
      continue;
    }
    CHECK(std::abs(n.dot(normal)) == doctest::Approx(1.0).epsilon(1e-9));
  }
  CHECK(without == 200);
  const SurfelMap planes = built(all, {.voxel = 0.0, .planes_only = true});
  CHECK(planes.points().size() == 3000);
  CHECK(planes.normals().size() == 3000);
  // Its tree is that of the points that are left.
  for (std::uint32_t i = 0; i < 3000; i += 100) {
    CHECK(planes.tree().nearest(planes.points()[i], 1.0).index == i);
  }
}

TEST_CASE("maps that no grid can hold are errors") {
  const auto code_of = [](const PointCloud& map, double voxel) {
    const auto built = SurfelMap::build(map, {.voxel = voxel});
    REQUIRE(!built);
    return built.error().code;
  };
  CHECK(code_of({}, 0.25) == ErrorCode::invalid_input);
  CHECK(code_of({{0, 0, 0}, {0, std::numeric_limits<double>::quiet_NaN(), 0}}, 0.25) ==
        ErrorCode::invalid_input);
  for (const double far : {1e6, 1e18, 1e300, 1.7e308}) {
    CHECK(code_of({{-far, 0, 0}, {far, 0, 0}}, 0.25) == ErrorCode::invalid_input);
    CHECK(code_of({{-far, 0, 0}, {far, 0, 0}}, 0.0) == ErrorCode::invalid_input);
  }
  CHECK(code_of({{0, 0, 0}, {1, 0, 0}}, 1e-12) == ErrorCode::invalid_input);
  CHECK(code_of({{0, 0, 0}, {1, 0, 0}}, 1e-320) == ErrorCode::invalid_input);

  PointCloud map = random_cloud(100, {-5, -5, -1}, {5, 5, 1});
  map[42].x() = 1e9;
  const auto wide = SurfelMap::build(map, {.voxel = 0.25});
  REQUIRE(!wide);
  CHECK(wide.error().message.find("its farthest point is number 42") != std::string::npos);
}

TEST_CASE("a remembered correspondence is the one a search would find") {
  const SurfelMap map = built(random_cloud(2000, {-5, -5, -1}, {5, 5, 1}), {.voxel = 0.0});
  std::mt19937 random(3);
  std::normal_distribution<double> normal;
  PointCloud scan = random_cloud(300, {-7, -7, -2}, {7, 7, 2}, 4);
  Correspondences correspondences;
  correspondences.begin(scan.size(), 1.0);
  std::size_t matched = 0, unmatched = 0;
  for (int round = 0; round < 60; ++round) {
    const double limit = round % 3 == 0 ? 1.0 : 0.4;
    const double far = std::pow(10.0, -(round % 4));
    const Eigen::Vector3d step = far * Eigen::Vector3d(normal(random), normal(random), 0.0);
    for (std::size_t i = 0; i < scan.size(); ++i) {
      const Point x = scan[i] - map.origin() + step;
      const auto nearest = std::ranges::min_element(
          map.points(), {}, [&](const Point& q) { return (q - x).squaredNorm(); });
      const auto index = static_cast<std::uint32_t>(nearest - map.points().begin());
      const std::uint32_t expected = (*nearest - x).norm() <= limit ? index : kNone;
      CHECK(correspondences.nearest(map, i, x, limit) == expected);
      ++(expected == kNone ? unmatched : matched);
    }
  }
  CHECK(matched > 1000);
  CHECK(unmatched > 1000);
}

}  // namespace vantage::matching
