#pragma once

#include <cstdint>
#include <optional>

#include "vantage/build/outliers.hpp"
#include "vantage/build/viewpoints.hpp"
#include "vantage/ground_filter.hpp"
#include "vantage/point_cloud.hpp"
#include "vantage/result.hpp"

namespace vantage {

/// Where viewpoints may stand (Sec. 2.2): some of the points of a cloud.
struct Places {
  PointsView points;  ///< the map or `own`
  IndexList which;    ///< into `points`: the ground, or all of them
  PointCloud own;     ///< places along the trajectory; empty over ground
  std::uint64_t ground_points = 0;
  std::uint64_t unreachable_voxels = 0;  ///< of the ground; no viewpoint is over them
};

/// The error of a map without ground.
[[nodiscard]] tl::unexpected<Error> no_ground();

/// The ground among some points. Errors: those of the filter; `internal` if it breaks its contract.
/// @param outliers  which points the filter does not get; none: it gets all
[[nodiscard]] Result<IndexList> ground_in(PointsView points, const GroundFilter& filter,
                                          const std::optional<OutlierParams>& outliers);

/// Finds the places for the viewpoints.
/// @param map         borrowed by the result
/// @param trajectory  may be empty unless viewpoints come from it
/// @param ground      not used along the trajectory
/// Errors: `invalid_input` if a needed ground or trajectory is missing; those of ground_in.
[[nodiscard]] Result<Places> places_of(PointsView map, PointsView trajectory,
                                       const GroundFilter* ground,
                                       const std::optional<OutlierParams>& outliers,
                                       const ViewpointParams& params);

}  // namespace vantage
