#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "build/places.hpp"
#include "build/plan_index.hpp"
#include "vantage/engine/build.hpp"
#include "vantage/partition.hpp"
#include "vantage/point_cloud.hpp"
#include "vantage/result.hpp"

namespace vantage {

/// What the regions need from the map.
struct Cut {
  Groups inside;                       ///< P_ij of Eq. 3, only for VisibilityScope::region
  std::vector<PointCloud> viewpoints;  ///< Eqs. 4-5, by RegionId
  std::uint64_t places_outside = 0;    ///< number of places outside all regions
};

/// Makes the viewpoints of some regions (Eqs. 4-5).
/// @param groups      g_ij: the places of each of the regions, indices into `points`
/// @param viewpoints  by RegionId
[[nodiscard]] Result<void> viewpoints_of_groups(PointsView points, const Groups& groups,
                                                std::span<const std::uint32_t> regions,
                                                const ViewpointParams& params,
                                                std::vector<PointCloud>& viewpoints);

/// Makes the viewpoints of all regions from places along a trajectory.
/// @return  number of places outside all regions
/// Errors: `invalid_input` if no place is in a region.
[[nodiscard]] Result<std::uint64_t> viewpoints_along(const Places& places,
                                                     const Partition& partition,
                                                     const ViewpointParams& params,
                                                     std::vector<PointCloud>& viewpoints);

/// Assigns every map point to a region (Eq. 3) and makes the viewpoints of each region (Eqs. 4-5).
/// Errors: `internal` for a partition that does not own every map point; `invalid_input` if no
/// place is in a region.
[[nodiscard]] Result<Cut> cut(PointsView map, const Places& places, const Partition& partition,
                              const BuildParams& params);

}  // namespace vantage
