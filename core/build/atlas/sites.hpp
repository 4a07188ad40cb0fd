#pragma once

#include <cstddef>
#include <vector>

#include "vantage/partition.hpp"
#include "vantage/point_cloud.hpp"

namespace vantage {

/// A viewpoint of a region.
struct SitePlace {
  RegionId region;
  Point position;  ///< map frame [m]
};

/// Viewpoints that are spread over the map: in each square of the plan the one nearest to its
/// middle. The squares are anchored to the world.
/// @param viewpoints  by RegionId, map frame [m]
/// @param spacing     edge of a square [m]; as large as needed if there would be too many sites
/// @param most        number of sites
/// @return            in the order of their regions
[[nodiscard]] std::vector<SitePlace> spread_sites(const std::vector<PointCloud>& viewpoints,
                                                  double spacing, std::size_t most);

}  // namespace vantage
