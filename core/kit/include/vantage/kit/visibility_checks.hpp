#pragma once

#include <span>

#include "vantage/result.hpp"
#include "vantage/visibility.hpp"

/// Checks of the input that visibility operators share.
namespace vantage {

/// Errors: `invalid_input` for a coordinate that is not finite.
[[nodiscard]] Result<void> check_viewpoints(std::span<const Point> viewpoints);

/// Errors: `invalid_input` for a map that check_points refuses, or a `max_range` that is not above
/// 0 m.
[[nodiscard]] Result<void> check_map(PointsView map, const VisibilityLimits& limits);

/// The same for operators that also use the bounds of the map.
/// Errors: those of check_map; `invalid_input` for `map_bounds` that leave out a point of the map.
[[nodiscard]] Result<void> check_map_in_bounds(PointsView map, const VisibilityLimits& limits);

/// For operators that flip points across a sphere of radius R (Eq. 6).
/// Errors: `invalid_input` unless R [m] is at least the smaller of D and `max_range`, and at most
/// 1e12 m.
[[nodiscard]] Result<void> check_flip_radius(double radius, const VisibilityLimits& limits);

}  // namespace vantage
