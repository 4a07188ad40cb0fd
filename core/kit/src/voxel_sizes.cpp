#include "vantage/kit/voxel_sizes.hpp"

#include <tbb/blocked_range.h>
#include <tbb/parallel_for.h>

#include <algorithm>
#include <bit>
#include <cmath>

#include "vantage/kit/hash.hpp"

namespace vantage {
namespace {

std::uint64_t voxel_of(const Point& p, double size) noexcept {
  const auto bits = [&](double x) {
    return std::bit_cast<std::uint64_t>(std::floor(x / size) + 0.0);  // no -0
  };
  return std::max<std::uint64_t>(1, hash(0, bits(p.x()), bits(p.y()), bits(p.z())));
}

/// Whether there are at least `count` different voxels.
bool has_voxels(const std::vector<std::uint64_t>& voxels, std::size_t count) {
  std::vector<std::uint64_t> seen(std::bit_ceil(2 * count + 2));  // 0: free
  std::size_t different = 0;
  for (const std::uint64_t voxel : voxels) {
    std::size_t slot = voxel & (seen.size() - 1);
    while (seen[slot] != 0 && seen[slot] != voxel) slot = (slot + 1) & (seen.size() - 1);
    if (seen[slot] == voxel) continue;
    seen[slot] = voxel;
    if (++different >= count) return true;
  }
  return false;
}

}  // namespace

std::vector<std::uint64_t> voxels_of(PointsView map, std::span<const std::uint32_t> candidates,
                                     double voxel_size) {
  std::vector<std::uint64_t> voxels(candidates.size());
  tbb::parallel_for(tbb::blocked_range<std::size_t>(0, voxels.size()), [&](const auto& range) {
    for (std::size_t i = range.begin(); i != range.end(); ++i) {
      voxels[i] = voxel_of(map[candidates[i]], voxel_size);
    }
  });
  return voxels;
}

VoxelSizes voxel_sizes_around(PointsView map, std::span<const std::uint32_t> candidates,
                              std::size_t count) {
  const auto leaves_enough = [&](double size) {
    return has_voxels(voxels_of(map, candidates, size), count);
  };
  double farthest = 0.0;  // above this size, only the voxels around the origin grow
  for (const std::uint32_t k : candidates) {
    farthest = std::max(farthest, map[k].cwiseAbs().maxCoeff());
  }
  VoxelSizes sizes{.enough = 0.25, .few = 0.25};
  while (leaves_enough(sizes.few) && sizes.few <= farthest) sizes.few *= 2.0;
  if (sizes.few > sizes.enough) sizes.enough = sizes.few / 2.0;
  while (!leaves_enough(sizes.enough) && sizes.enough > 1e-6) sizes.enough /= 2.0;
  for (int halving = 0; halving < 10; ++halving) {
    const double middle = std::sqrt(sizes.few * sizes.enough);
    (leaves_enough(middle) ? sizes.enough : sizes.few) = middle;
  }
  return sizes;
}

}  // namespace vantage
