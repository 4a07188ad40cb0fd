#include "common/surfel_voxels.hpp"

#include <algorithm>
#include <optional>

#include "common/element_numbers.hpp"

namespace vantage::matching {
namespace {

// In a map that is not thinned, a point so near is that of the surfel [m]: stored positions are
// rounded.
constexpr double kSamePlace = 1e-3;

}  // namespace

void SurfelVoxels::make(const SurfelMap& map) const {
  const SurfelGrid grid(map.origin(), options_.edge());
  const auto surfels = static_cast<std::uint32_t>(map.points().size());
  order_.reserve(surfels);
  for (std::uint32_t i = 0; i < surfels; ++i) {
    if (const auto voxel = map.voxel(i, grid)) order_.emplace_back(*voxel, i);
  }
  std::ranges::sort(order_);
  bytes_ = order_.capacity() * sizeof(order_.front());
}

std::vector<std::uint32_t> SurfelVoxels::surfels_at(const SurfelMap& map, PointsView seen) const {
  if (!seen.empty()) std::call_once(made_, [&] { make(map); });
  const SurfelGrid grid(map.origin(), options_.edge());
  const bool thinned = options_.voxel > 0.0;
  std::vector<bool> belongs(map.points().size(), false);
  std::optional<std::uint64_t> last;
  auto begin = order_.end(), end = begin;  // of the last voxel
  for (const Point& p : seen) {
    const auto voxel = grid.voxel_of(p);
    if (!voxel || (voxel == last && thinned)) continue;
    if (voxel != last) {
      last = voxel;
      begin = std::ranges::lower_bound(order_, std::pair(*voxel, std::uint32_t{0}));
      for (end = begin; end != order_.end() && end->first == *voxel;) ++end;
    }
    for (auto at = begin; at != end; ++at) {
      if (thinned || (map.points()[at->second] + map.origin() - p).norm() <= kSamePlace) {
        belongs[at->second] = true;
      }
    }
  }
  return numbers_of(belongs);
}

}  // namespace vantage::matching
