#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "vantage/point_cloud.hpp"
#include "vantage/result.hpp"

// One point of each voxel that holds points. The grid is anchored at the origin of the frame, so
// that neighbouring regions and shifted subsets share voxels.
namespace vantage {

/// Error: `invalid_input` for a size that is not positive.
[[nodiscard]] Result<void> check_voxel_size(double voxel_size);

/// The centroid of each voxel's points (Eq. 4). The centroids are ordered by voxel (z, then y, then
/// x). Each is summed in the order of `points`.
/// @param points      N points [m]
/// @param voxel_size  edge length [m], > 0
/// Errors: `invalid_input` for a non-finite point or a point beyond 2^50 voxels from the origin.
[[nodiscard]] Result<PointCloud> voxel_centroids(PointsView points, double voxel_size);

/// The same of the points that `which` names. Precondition: every index < points.size().
[[nodiscard]] Result<PointCloud> voxel_centroids(PointsView points,
                                                 std::span<const std::uint32_t> which,
                                                 double voxel_size);

struct TimedPoints {
  PointCloud points;
  std::vector<double> times;  ///< of each point [s]; empty if unknown
};
/// The same of points that have times: a centroid has the mean of its points' times.
/// @param times  N times [s], or none
[[nodiscard]] Result<TimedPoints> voxel_centroids(PointsView points, std::span<const double> times,
                                                  double voxel_size);

/// Of each voxel's points that `which` names, the one that is nearest to the voxel's centre, the
/// first of equally near ones; they keep their order. Arguments and errors as above.
[[nodiscard]] Result<PointCloud> nearest_to_voxel_centres(PointsView points,
                                                          std::span<const std::uint32_t> which,
                                                          double voxel_size);

}  // namespace vantage
