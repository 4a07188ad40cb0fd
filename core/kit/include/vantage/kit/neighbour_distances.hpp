#pragma once

#include <cstddef>
#include <vector>

#include "vantage/point_cloud.hpp"

namespace vantage {

/// The mean distance of each point to its nearest others [m]. It depends neither on the order of
/// the points nor on the number of threads.
/// @param points      N finite points, fewer than 2^32 [m]
/// @param neighbours  how many others; all of them if there are fewer. > 0
/// @return            by point; 0 for a point without others
[[nodiscard]] std::vector<double> neighbour_distances(PointsView points, std::size_t neighbours);

}  // namespace vantage
