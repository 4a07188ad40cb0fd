#pragma once

#include "vantage/api.hpp"
#include "vantage/engine/build_params.hpp"
#include "vantage/point_cloud.hpp"

namespace vantage {

/// Leaves statistical outliers out, as PCL's StatisticalOutlierRemoval does: a point stays if its
/// mean distance to its nearest others is at most mean + ratio * standard deviation, both taken
/// over all points. The result depends neither on the order of the points nor on the number of
/// threads.
/// @param points  N finite points, fewer than 2^32 [m]
/// @return        the indices of the points that stay, strictly ascending; may be empty
[[nodiscard]] VANTAGE_API IndexList without_outliers(PointsView points,
                                                     const OutlierParams& params);

}  // namespace vantage
