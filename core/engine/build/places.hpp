#pragma once

#include <cstdint>

#include "vantage/engine/viewpoints.hpp"
#include "vantage/ground_filter.hpp"
#include "vantage/point_cloud.hpp"
#include "vantage/result.hpp"

namespace vantage {

/// Where viewpoints may stand (Sec. 2.2): some of the points of a cloud.
struct Places {
  PointsView points;  ///< the map or `own`
  IndexList which;    ///< into `points`: the ground, or all
  PointCloud own;     ///< along the trajectory
  std::uint64_t ground_points = 0;
  std::uint64_t unreachable_viewpoints = 0;  ///< over ground that was left out
};

/// @param map         borrowed by the result
/// @param trajectory  may be empty unless viewpoints come from it
/// @param ground      not used along the trajectory
/// Errors: `invalid_input` for no ground or no trajectory where one is needed; what the ground
/// filter reports; `internal` if it breaks its contract.
[[nodiscard]] Result<Places> places_of(PointsView map, PointsView trajectory,
                                       const GroundFilter* ground, const ViewpointParams& params);

}  // namespace vantage
