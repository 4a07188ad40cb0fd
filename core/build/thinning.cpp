#include "vantage/build/thinning.hpp"

#include <tbb/parallel_sort.h>

#include <algorithm>
#include <cstdint>
#include <limits>
#include <span>
#include <tuple>
#include <vector>

#include "vantage/kit/voxel_sizes.hpp"

namespace vantage {
namespace {

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

IndexList thinned(PointsView map, IndexList candidates, const ThinningParams& params) {
  if (params.voxel_size) return one_a_voxel(map, candidates, *params.voxel_size);
  const std::size_t budget = *params.budget;
  if (candidates.size() <= budget) return candidates;
  return one_a_voxel(map, candidates, voxel_sizes_around(map, candidates, budget + 1).few);
}

}  // namespace vantage
