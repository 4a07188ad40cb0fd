#pragma once

#include "vantage/point_cloud.hpp"
#include "vantage/pose.hpp"

namespace vantage::voxel_search {

/// Finds out how a sensor is tilted, by the ground around it: the plane within 30 degrees of the
/// sensor's xy plane that has the most points of the lowest ones. A slope counts as a tilt.
/// Deterministic.
/// @param scan  N points, sensor frame [m], evenly thinned
/// @return      T_level_sensor, a rotation that turns the ground's normal to z and turns nothing
///              about it; no rotation if the scan shows no ground
[[nodiscard]] Pose level_by_ground(PointsView scan);

}  // namespace vantage::voxel_search
