#pragma once

#include "vantage/point_cloud.hpp"
#include "vantage/result.hpp"

namespace vantage::matching {

/// The error of a map that spans more voxels than a grid has: `invalid_input`. It names the point
/// that lies farthest from the middle of the others: mostly that one is wrong.
/// @param map   at least one point, finite [m]
/// @param edge  of a voxel [m]
[[nodiscard]] Error too_wide(PointsView map, double edge);

}  // namespace vantage::matching
