#pragma once

#include <span>

#include "vantage/api.hpp"
#include "vantage/point_cloud.hpp"
#include "vantage/pose.hpp"
#include "vantage/result.hpp"

namespace vantage {

/// Removes the sensor's own motion from a sweep: moves every point to where the sensor would have
/// seen it at the scan's stamp. The sensor is assumed to move at constant velocity in its frame at
/// the stamp. At t seconds after the stamp it is at
/// `interpolate(Pose{}, T_now_later, t / interval)`; this also holds before the stamp and beyond
/// the interval. Without motion, the points stay as they are, bit for bit.
/// @param points       N points [m], each in the sensor frame at the time of its measurement; a
///                     non-finite point stays non-finite
/// @param seconds      N times [s] after the stamp; negative before it
/// @param T_now_later  where the sensor is `interval` seconds after the stamp, in its frame at the
///                     stamp; its rotation is less than half a turn
/// @param interval     [s]
/// @return             N points in the same order, sensor frame at the stamp [m]; each result
///                     depends on its own point alone
/// Errors: `invalid_input` for sizes that differ, an interval that is not positive and finite, a
/// pose that is not a rigid transform, or a time that is not finite (in seconds or in intervals).
/// Cost: one sine and one cosine for each time that differs from the time of the point before.
[[nodiscard]] VANTAGE_API Result<PointCloud> deskew(PointsView points,
                                                    std::span<const float> seconds,
                                                    const Pose& T_now_later, double interval);

}  // namespace vantage
