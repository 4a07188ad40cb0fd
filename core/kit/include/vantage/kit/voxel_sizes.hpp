#pragma once

#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

#include "vantage/point_cloud.hpp"

// Voxels of any size, anchored at the origin of the frame.
namespace vantage {

/// The voxel of each candidate, as a 64-bit hash that is never 0. Two voxels of one map almost
/// certainly have different hashes; with equal hashes, they would count as one.
/// @param map         finite points [m]
/// @param candidates  indices into `map`
[[nodiscard]] std::vector<std::uint64_t> voxels_of(PointsView map,
                                                   std::span<const std::uint32_t> candidates,
                                                   double voxel_size);

/// Two voxel sizes [m] that enclose a wanted number of voxels, `count`: enough <= few, with a
/// difference of at most about 1 %. The number of voxels falls as the size grows, but not quite
/// monotonically, so that other such pairs may exist.
struct VoxelSizes {
  double enough;  ///< gives `count` voxels or more, unless even 1 micrometre gives fewer
  double few;     ///< gives fewer voxels, unless even the 8 at the origin are `count` or more
};
/// Finds two sizes around `count` voxels. Arguments as above. Precondition: count > 0.
[[nodiscard]] VoxelSizes voxel_sizes_around(PointsView map,
                                            std::span<const std::uint32_t> candidates,
                                            std::size_t count);

}  // namespace vantage
