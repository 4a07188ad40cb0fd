#pragma once

#include <cstdint>
#include <span>
#include <tuple>
#include <vector>

#include "vantage/api.hpp"
#include "vantage/params.hpp"
#include "vantage/point_cloud.hpp"
#include "vantage/result.hpp"

namespace vantage {

/// [viewpoints]: Sec. 2.2.
struct ViewpointParams {
  double voxel_size = 1.0;     // s_voxel
  double sensor_height = 1.0;  // h_s

  static constexpr auto schema() {
    return std::tuple{
        optional("voxel_size", &ViewpointParams::voxel_size, "m",
                 "s_voxel: one viewpoint for each ground voxel of this size", positive,
                 Source{"Eq. 4", "Yagi et al. 2026, Sec. 2.2"}),
        optional("sensor_height", &ViewpointParams::sensor_height, "m",
                 "h_s: height of the sensor above the ground",
                 Source{"Eq. 5", "Yagi et al. 2026, Sec. 2.2"}),
    };
  }
};

/// One point a voxel, the centroid of the voxel's points (Eq. 4).
/// The grid is anchored at the origin of the frame, so that neighbouring regions and shifted
/// subsets share voxels. Ordered by voxel (z, then y, then x); a voxel's sum runs in the order of
/// `points`.
/// @param points      N points [m]
/// @param voxel_size  edge length [m], > 0
/// Errors: `invalid_input` for a non-finite point or one beyond 2^50 voxels from the origin.
[[nodiscard]] VANTAGE_API Result<PointCloud> voxel_centroids(PointsView points, double voxel_size);

/// Virtual viewpoints q over ground points g_ij: voxel centroids, raised by h_s (Eqs. 4-5).
[[nodiscard]] VANTAGE_API Result<PointCloud> viewpoints_over(PointsView ground,
                                                             const ViewpointParams& params);

/// The same over the points of `map` that `ground` names. Precondition: every index < map.size().
[[nodiscard]] VANTAGE_API Result<PointCloud> viewpoints_over(PointsView map,
                                                             std::span<const std::uint32_t> ground,
                                                             const ViewpointParams& params);

}  // namespace vantage
