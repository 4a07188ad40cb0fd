#include "view/camera.hpp"

#include <doctest/doctest.h>

#include <Eigen/Geometry>
#include <cmath>

using namespace vantage;
using namespace vantage::view;

namespace {

/// The largest |x| and |y| of the points in the picture, whose edges are at 1.
Eigen::Vector2d reach(const PointCloud& points, const Camera& camera, double fov, double aspect) {
  const Eigen::Vector3d right = Eigen::Vector3d::UnitZ().cross(camera.front).normalized();
  const Eigen::Vector3d up = camera.front.cross(right);
  Eigen::Vector2d most = Eigen::Vector2d::Zero();
  for (const Point& p : points) {
    const Eigen::Vector3d d = p - camera.lookat;
    const double depth = camera.distance - d.dot(camera.front);
    REQUIRE(depth > 0.0);
    const double y = std::abs(d.dot(up)) / depth / std::tan(fov / 2);
    const double x = std::abs(d.dot(right)) / depth / std::tan(fov / 2) / aspect;
    most = most.cwiseMax(Eigen::Vector2d(x, y));
  }
  return most;
}

PointCloud block(double x, double y, double z) {
  PointCloud points;
  for (int i = 0; i <= 20; ++i) {
    for (int j = 0; j <= 20; ++j) {
      for (int k = 0; k <= 2; ++k) points.emplace_back(x * i / 20, y * j / 20, z * k / 2);
    }
  }
  return points;
}

}  // namespace

TEST_CASE("everything is in the picture, and fills it one way") {
  for (const auto& [x, y, z] :
       {std::array{100.0, 50.0, 10.0}, {20.0, 300.0, 5.0}, {3.0, 3.0, 90.0}}) {
    for (const double aspect : {1.6, 0.5}) {
      const PointCloud points = block(x, y, z);
      const Camera camera = oblique_view(points, 0.6, aspect);
      const Eigen::Vector2d most = reach(points, camera, 0.6, aspect);
      CHECK(most.maxCoeff() <= 1.0);
      CHECK(most.maxCoeff() > 0.9);
      CHECK(camera.front.norm() == doctest::Approx(1.0));
      CHECK(camera.front.z() > 0.5);
    }
  }
}

TEST_CASE("a few stray points far away do not make all else small") {
  PointCloud points = block(100, 50, 10);
  const Camera without = oblique_view(points, 0.6, 1.6);
  points.emplace_back(5000, 5000, 300);
  CHECK(oblique_view(points, 0.6, 1.6).distance == doctest::Approx(without.distance).epsilon(0.05));
}

TEST_CASE("one point, and none, have a view") {
  CHECK(oblique_view(PointCloud{{1, 2, 3}}, 0.6, 1.6).lookat == Point(1, 2, 3));
  CHECK(oblique_view({}, 0.6, 1.6).distance > 0.0);
}
