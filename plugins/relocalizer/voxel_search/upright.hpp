#pragma once

#include "vantage/point_cloud.hpp"

namespace vantage::voxel_search {

/// The part of a scan that stands up: what find_places searches with. The ground matches at any
/// heading and says nothing. The whole scan if hardly anything stands up.
/// @param scan  sensor frame, z up [m]
[[nodiscard]] PointCloud upright_part(PointsView scan);

}  // namespace vantage::voxel_search
