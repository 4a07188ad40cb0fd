// Open3D's HiddenPointRemoval is the reference for the flip kernel.
#include <doctest/doctest.h>

#include <open3d/geometry/PointCloud.h>
#include <open3d/geometry/TriangleMesh.h>

#include <algorithm>

#include "scenes.hpp"

namespace vantage::test {
namespace {

IndexList open3d_hidden_point_removal(const PointCloud& map, const Point& viewpoint,
                                      double radius) {
  const open3d::geometry::PointCloud cloud(map);
  const auto [mesh, indices] = cloud.HiddenPointRemoval(viewpoint, radius);
  IndexList result(indices.begin(), indices.end());
  std::sort(result.begin(), result.end());
  std::erase(result, static_cast<std::uint32_t>(map.size()));  // the viewpoint itself
  return result;
}

TEST_CASE("hpr equals Open3D on 50,000 points of the recorded street") {
  const auto& map = street();
  if (!map) return;
  const PointCloud cloud = thinned(*map, 50000);
  const double diagonal = bounds_of(cloud).diagonal();
  for (const Point& viewpoint :
       {Point(0.34, 0.01, 0.0), Point(15.0, 1.0, -0.7), Point(63.97, 9.27, -0.53)}) {
    for (const double alpha : {1.0, 100.0, 1000.0}) {
      CAPTURE(alpha);
      const IndexList ours = seen(cloud, viewpoint, "alpha = " + std::to_string(alpha));
      CHECK(ours.size() > 200);
      CHECK(ours.size() < 50000);
      CHECK(ours == open3d_hidden_point_removal(cloud, viewpoint, alpha * diagonal));
    }
  }
}

TEST_CASE("hpr equals Open3D on a random cloud") {
  const PointCloud cloud = ball(11, 5000, 20.0, 0.5);
  const Point viewpoint(0.1, -0.2, 0.15);
  CHECK(seen(cloud, viewpoint, "alpha = 10.0") ==
        open3d_hidden_point_removal(cloud, viewpoint, 10.0 * bounds_of(cloud).diagonal()));
}

}  // namespace
}  // namespace vantage::test
