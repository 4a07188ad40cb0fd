#pragma once

#include <vector>

#include "objective.hpp"
#include "vantage/map_element.hpp"
#include "vantage/point_cloud.hpp"
#include "vantage/pose.hpp"

namespace vantage::ndt {

/// The derivatives of E at a pose, Gaussian by Gaussian: `Objective::derivatives` is their sum.
/// @param scan  N points, sensor frame [m]; finite
/// @return      ascending by Gaussian; those without a point in their neighbourhood are left out
[[nodiscard]] std::vector<Pull> pulls_on(const Objective& objective, PointsView scan,
                                         const Pose& T_map_scan);

}  // namespace vantage::ndt
