// The recorded street: the answer equals Qhull's on all points, from the road and from above it.
#include <doctest/doctest.h>

#include <vector>

#include "scenes.hpp"

namespace vantage::test {
namespace {

TEST_CASE("on the recorded street hpr equals Qhull on all points") {
  const auto& map = street();
  if (!map) return;
  const auto check = [](PointsView cloud, const Point& viewpoint, const hpr::Settings& settings) {
    const auto ours = hpr::hidden_point_removal(cloud, viewpoint, settings);
    const auto plain = hpr::hidden_point_removal_by_qhull(cloud, viewpoint, settings);
    REQUIRE_MESSAGE(ours, to_string(ours.error()));
    REQUIRE_MESSAGE(plain, to_string(plain.error()));
    CHECK(!ours->empty());
    CHECK(*ours == *plain);
  };
  const std::vector<Point> viewpoints{{0.34, 0.01, 0.0},
                                      {15.0, 1.0, 0.0},
                                      {30.0, 2.0, -0.7},
                                      {63.97, 9.27, -0.53},
                                      {30.0, 2.0, 40.0}};
  SUBCASE("flip") {
    for (const Point& viewpoint : viewpoints) check(*map, viewpoint, flip(*map, 100.0));
    check(*map, viewpoints[1], flip(*map, 1.0));
    check(*map, viewpoints[1], flip(*map, 1e4));
  }
  SUBCASE("flip, culled with a margin, then Qhull") {
    const auto settings = flip(*map, 100.0);
    for (const Point& viewpoint : {viewpoints[2], viewpoints[4]}) {
      const auto culled = hpr::hidden_point_removal_by_culled_qhull(*map, viewpoint, settings);
      const auto plain = hpr::hidden_point_removal_by_qhull(*map, viewpoint, settings);
      REQUIRE(culled);
      REQUIRE(plain);
      CHECK(*culled == *plain);
    }
  }
  SUBCASE("flip, limited range") {
    auto settings = flip(*map, 100.0);
    settings.max_range = 25.0;
    check(*map, viewpoints[2], settings);
  }
  SUBCASE("inversion") {
    for (const Point& viewpoint : viewpoints) check(*map, viewpoint, inversion());
  }
  SUBCASE("5,000 km away") {
    const Eigen::Vector3d far(0.0, 5e6, 0.0);
    const PointCloud here = snapped(*map);
    const PointCloud there = translated(here, far);
    const Point viewpoint(15.0, 1.0, 0.25);
    const auto a = hpr::hidden_point_removal(here, viewpoint, flip(here, 100.0));
    const auto b = hpr::hidden_point_removal(there, viewpoint + far, flip(here, 100.0));
    REQUIRE(a);
    REQUIRE(b);
    CHECK(*a == *b);
    check(there, viewpoint + far, flip(there, 100.0));
  }
}

}  // namespace
}  // namespace vantage::test
