#include "vantage/engine/thinning.hpp"

#include <tbb/blocked_range.h>
#include <tbb/parallel_for.h>
#include <tbb/parallel_sort.h>

#include <algorithm>
#include <bit>
#include <cmath>
#include <limits>
#include <tuple>
#include <utility>

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

struct Member {
  std::uint64_t voxel;
  std::uint32_t index;
};

/// The member nearest to the mean of all. The mean is taken over offsets, so that no digits are
/// lost far from the origin.
/// @param members  of one voxel, sorted by coordinates
std::uint32_t middle_of(PointsView map, std::span<const Member> members) {
  const Point& first = map[members.front().index];
  Point sum = Point::Zero();
  for (const Member& member : members) sum += map[member.index] - first;
  const Point mean = sum / static_cast<double>(members.size());
  std::uint32_t nearest = members.front().index;
  double least = std::numeric_limits<double>::infinity();
  for (const Member& member : members) {
    const double squared = (map[member.index] - first - mean).squaredNorm();
    if (squared >= least) continue;
    least = squared;
    nearest = member.index;
  }
  return nearest;
}

IndexList one_a_voxel(PointsView map, const IndexList& candidates, double voxel_size) {
  std::vector<Member> members(candidates.size());
  const std::vector<std::uint64_t> voxels = voxels_of(map, candidates, voxel_size);
  for (std::size_t i = 0; i < members.size(); ++i) members[i] = {voxels[i], candidates[i]};
  const auto key = [&](const Member& member) {
    const Point& p = map[member.index];
    return std::tuple(member.voxel, p.x(), p.y(), p.z(), member.index);
  };
  tbb::parallel_sort(members.begin(), members.end(),
                     [&](const Member& a, const Member& b) { return key(a) < key(b); });
  IndexList chosen;
  for (std::size_t begin = 0, end = 0; begin < members.size(); begin = end) {
    while (end < members.size() && members[end].voxel == members[begin].voxel) ++end;
    chosen.push_back(middle_of(map, std::span(members).subspan(begin, end - begin)));
  }
  std::sort(chosen.begin(), chosen.end());
  return chosen;
}

}  // namespace

Result<void> ThinningParams::validate() const {
  if (voxel_size.has_value() != budget.has_value()) return {};
  return fail_at(
      {"voxel_size", "budget"},
      voxel_size
          ? "'voxel_size' and 'budget' both set the amount of thinning; give only one of them"
          : "thinning needs 'voxel_size' or 'budget'");
}

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

IndexList thinned(PointsView map, IndexList candidates, const ThinningParams& params) {
  if (params.voxel_size) return one_a_voxel(map, candidates, *params.voxel_size);
  const std::size_t budget = *params.budget;
  if (candidates.size() <= budget) return candidates;
  return one_a_voxel(map, candidates, voxel_sizes_around(map, candidates, budget + 1).few);
}

}  // namespace vantage
