#pragma once

#include <span>

#include "vantage/api.hpp"
#include "vantage/point_cloud.hpp"
#include "vantage/pose.hpp"
#include "vantage/result.hpp"

namespace vantage {

/// Takes the sensor's own motion out of a sweep: every point as the sensor would have seen it at
/// the scan's stamp. The sensor is taken to move at constant velocity, in its frame at the stamp:
/// at t seconds after the stamp it is at `interpolate(Pose{}, T_now_later, t / interval)`, also
/// before the stamp and beyond the interval. Without motion the points stay as they are, bit by
/// bit.
/// @param points       N points [m], each in the sensor frame of the moment it was measured at;
///                     one that is not finite stays so
/// @param seconds      N moments [s] after the stamp; below 0 before it
/// @param T_now_later  where the sensor is `interval` seconds after the stamp, in its frame at the
///                     stamp; turned by less than half a turn
/// @param interval     [s]
/// @return             N points in the same order, sensor frame at the stamp [m]; each depends on
///                     itself alone
/// Errors: `invalid_input` for sizes that differ, an interval that is not positive and finite, a
/// pose that is no rigid transform, or a moment that is not finite (in seconds or in intervals).
/// Cost: a sine and a cosine for each moment that differs from the one of the point before it.
[[nodiscard]] VANTAGE_API Result<PointCloud> deskew(PointsView points,
                                                    std::span<const float> seconds,
                                                    const Pose& T_now_later, double interval);

}  // namespace vantage
