#pragma once

#include <Eigen/Core>
#include <algorithm>
#include <cstddef>

#include "block_table.hpp"
#include "vantage/point_cloud.hpp"
#include "vantage/pose.hpp"
#include "voxel_map.hpp"

namespace vantage::matching {

/// Whether a point lies in a bare voxel, or `distance` [m] from one: along an axis, and from the
/// voxel's middle, because what is in the voxel lies anywhere in it.
[[nodiscard]] inline bool is_covered(const ndt::VoxelMap& voxels, const Point& p, double distance) {
  const ndt::BlockTable blocks = voxels.view().blocks;
  const auto is_bare = [&](const Point& at) {
    const ndt::VoxelKey key = voxels.key_of(at);
    return key != ndt::kNoVoxel && (ndt::block_at(blocks, key >> 6U).bare >> (key & 63U) & 1U) != 0;
  };
  if (is_bare(p)) return true;
  // No voxel may be stepped over, but distances of a hundred voxels have no use.
  const double edge = voxels.options().resolution;
  const double farthest = std::clamp(distance - 0.5 * edge, 0.0, 100.0 * edge);
  for (double step = std::min(edge, farthest);; step = std::min(step + edge, farthest)) {
    for (Eigen::Index axis = 0; axis < 3; ++axis) {
      const Eigen::Vector3d offset = step * Eigen::Vector3d::Unit(axis);
      if (is_bare(p + offset) || is_bare(p - offset)) return true;
    }
    if (step >= farthest) return false;
  }
}

/// How many of a scan's points are covered.
[[nodiscard]] inline std::size_t covered_points(const ndt::VoxelMap& voxels, PointsView scan,
                                                const Pose& T_voxels_scan, double distance) {
  const auto covered = [&](const Point& p) {
    return is_covered(voxels, T_voxels_scan * p, distance);
  };
  return static_cast<std::size_t>(std::ranges::count_if(scan, covered));
}

}  // namespace vantage::matching
