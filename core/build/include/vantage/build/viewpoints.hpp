#pragma once

#include <cstdint>
#include <span>

#include "vantage/api.hpp"
#include "vantage/engine/build_params.hpp"
#include "vantage/point_cloud.hpp"
#include "vantage/result.hpp"

namespace vantage {

/// Places along a trajectory: its positions, moved sideways by each lateral offset. All positions
/// for the first offset come before those for the second. The direction of travel is measured in
/// plan view between positions at least half a voxel apart, so that the noise of a standing sensor
/// gives no direction.
/// @param trajectory  N positions of the sensor in driving order, map frame [m]
/// Errors: `invalid_input` for an empty trajectory or a position that is not finite, or for offsets
/// from a trajectory that stays within half a voxel.
[[nodiscard]] VANTAGE_API Result<PointCloud> places_along(PointsView trajectory,
                                                          const ViewpointParams& params);

/// The ground that a robot can reach. The ground of each square metre in plan view is divided into
/// levels, separated by gaps in height of more than `max_step`. Two levels are connected if their
/// mean heights differ by at most `max_step` and their square metres are neighbours (of eight), or
/// two apart with no ground between them. The result is all ground connected to ground below the
/// trajectory. In a square metre, the level below the trajectory is the highest one whose mean
/// height is at most `max_step` above it. Without a trajectory, the result is the connected set
/// with the most levels.
/// @param map         N points, z up [m]
/// @param ground      indices into `map`, strictly ascending
/// @param trajectory  positions of the sensor [m]; may be empty
/// @param max_step    [m], > 0
/// @return            the reachable part of `ground`, for any order of the points
/// Errors: `invalid_input` for a point that is not finite or lies beyond 2^50 m from the origin, or
/// for a trajectory with no ground below it.
[[nodiscard]] VANTAGE_API Result<IndexList> reachable_ground(PointsView map,
                                                             std::span<const std::uint32_t> ground,
                                                             PointsView trajectory,
                                                             double max_step);

/// Virtual viewpoints q at each height offset. All viewpoints at the first height come before those
/// at the second.
/// ViewpointSource::ground: voxel centroids of the ground points g_ij, raised by h_s (Eqs. 4-5).
/// ViewpointSource::trajectory: in each voxel, the place of `places_along` nearest to the centre
/// (the first of equally near places), in the order of `which`. Each is one of the places, not a
/// mean of several.
/// @param points  the map, or the result of `places_along`; map frame [m]
/// @param which   indices into `points`: of the ground, or of all places
/// Errors: as `voxel_centroids`. Precondition: every index < points.size().
[[nodiscard]] VANTAGE_API Result<PointCloud> viewpoints_over(PointsView points,
                                                             std::span<const std::uint32_t> which,
                                                             const ViewpointParams& params);

}  // namespace vantage
