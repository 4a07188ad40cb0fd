#pragma once

#include <Eigen/Core>
#include <span>
#include <string>
#include <vector>

#include "vantage/point_cloud.hpp"
#include "vantage/result.hpp"

namespace vantage::exporting {

/// The largest accepted rounding of a coordinate by float32 [m].
inline constexpr double kMostRounding = 0.001;

/// A point less an origin, as a format of other programs stores it.
using FloatPoint = Eigen::Vector3f;

[[nodiscard]] std::vector<FloatPoint> rounded(PointsView points, const Point& origin);

/// The largest distance by which rounding moves a coordinate [m].
/// @param rounded_points  of these points
/// @param format          completes "... hold float32" in messages
/// @param bundle          its name in messages
/// Errors: `invalid_input` if it is more than kMostRounding.
[[nodiscard]] Result<double> rounding_of(PointsView points, const Point& origin,
                                         std::span<const FloatPoint> rounded_points,
                                         const std::string& format, const std::string& bundle);

}  // namespace vantage::exporting
