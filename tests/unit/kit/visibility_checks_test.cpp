#include "vantage/kit/visibility_checks.hpp"

#include <doctest/doctest.h>

#include <cmath>
#include <limits>

namespace vantage {
namespace {

constexpr double kEndless = std::numeric_limits<double>::infinity();  // a distance

void refused(const Result<void>& result, const std::string& because) {
  REQUIRE_FALSE(result);
  CHECK(result.error().code == ErrorCode::invalid_input);
  CHECK_MESSAGE(result.error().message.find(because) != std::string::npos, result.error().message);
}

TEST_CASE("viewpoints are finite; none is fine") {
  CHECK(check_viewpoints({}));
  CHECK(check_viewpoints(PointCloud{{1.0, 2.0, 3.0}}));
  for (const double bad : {kEndless, -kEndless, std::nan("")}) {
    refused(check_viewpoints(PointCloud{{1.0, 2.0, 3.0}, {0.0, 0.0, bad}}), "viewpoint");
  }
}

TEST_CASE("a map has points, and the sensor a reach") {
  const PointCloud map{{0.0, 0.0, 0.0}, {3.0, 4.0, 0.0}};
  const VisibilityLimits limits{.map_bounds = bounds_of(map), .max_range = 5.0};
  CHECK(check_map(map, limits));
  CHECK(check_map(map, {.map_bounds = {}, .max_range = kEndless}));
  refused(check_map({}, limits), "no points");
  for (const double bad : {0.0, -1.0, std::nan("")}) {
    refused(check_map(map, {.map_bounds = limits.map_bounds, .max_range = bad}), "max_range");
  }
}

TEST_CASE("the bounds enclose every point, on all six sides") {
  const PointCloud map{{0.0, 0.0, 0.0}, {3.0, 4.0, 5.0}};
  const VisibilityLimits limits{.map_bounds = bounds_of(map)};
  CHECK(check_map_in_bounds(map, limits));
  for (Eigen::Index axis = 0; axis < 3; ++axis) {
    VisibilityLimits low = limits, high = limits;
    low.map_bounds.min[axis] = 0.5;
    high.map_bounds.max[axis] = 0.5;
    refused(check_map_in_bounds(map, low), "map_bounds");
    refused(check_map_in_bounds(map, high), "map_bounds");
  }
  refused(check_map_in_bounds(map, {}), "map_bounds");
}

TEST_CASE("a sphere to turn about holds all that is in reach, and leaves digits") {
  const VisibilityLimits limits{.map_bounds = {{0.0, 0.0, 0.0}, {3.0, 4.0, 0.0}}};
  CHECK(check_flip_radius(5.0, limits));
  CHECK(check_flip_radius(2.0, {.map_bounds = limits.map_bounds, .max_range = 2.0}));
  refused(check_flip_radius(4.9, limits), "radius R");
  refused(check_flip_radius(2e12, limits), "radius R");
  refused(check_flip_radius(std::nan(""), limits), "radius R");
}

}  // namespace
}  // namespace vantage
