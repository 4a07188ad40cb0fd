#include "vantage/kit/visibility_checks.hpp"

#include <algorithm>
#include <string>

namespace vantage {
namespace {

constexpr double kMaxRadius = 1e12;  // [m]; 2R - |p| is then rounded to 0.1 mm

}  // namespace

Result<void> check_viewpoints(std::span<const Point> viewpoints) {
  if (all_finite(viewpoints)) return {};
  return fail(ErrorCode::invalid_input, "a viewpoint has a coordinate that is not finite");
}

Result<void> check_map(PointsView map, const VisibilityLimits& limits) {
  VANTAGE_CHECK(check_points(map, "the map"));
  if (limits.max_range > 0.0) return {};
  return fail(ErrorCode::invalid_input, "max_range must be > 0 m");
}

Result<void> check_map_in_bounds(PointsView map, const VisibilityLimits& limits) {
  VANTAGE_CHECK(check_map(map, limits));
  const Bounds3& bounds = limits.map_bounds;
  const Bounds3 needed = bounds_of(map);
  if ((bounds.min.array() <= needed.min.array()).all() &&
      (bounds.max.array() >= needed.max.array()).all()) {
    return {};
  }
  return fail(ErrorCode::invalid_input, "map_bounds does not enclose every point of the map");
}

Result<void> check_flip_radius(double radius, const VisibilityLimits& limits) {
  // No point of the map is farther from a viewpoint within its bounds than the diagonal.
  const double reach = std::min(limits.map_bounds.diagonal(), limits.max_range);
  if (radius >= reach && radius <= kMaxRadius) return {};
  return fail(ErrorCode::invalid_input,
              "the radius R is " + std::to_string(radius) + " m; it must be at least " +
                  std::to_string(reach) +
                  " m, the reach of the sensor or the diagonal of the map, and at most 1e12 m");
}

}  // namespace vantage
