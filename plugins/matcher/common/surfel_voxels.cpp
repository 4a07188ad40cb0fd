#include "common/surfel_voxels.hpp"

#include <algorithm>

#include "block_table.hpp"
#include "common/element_numbers.hpp"
#include "voxel_map.hpp"

namespace vantage::matching {
namespace {

// In a map that is not thinned, a point so near is that of the surfel [m]: stored positions are
// rounded.
constexpr double kSamePlace = 1e-3;

}  // namespace

void SurfelVoxels::make(const SurfelMap& map) const {
  const PointsView points = map.points();
  order_.reserve(points.size());
  for (std::uint32_t i = 0; i < points.size(); ++i) order_.emplace_back(key_of(points[i]), i);
  std::ranges::sort(order_);
  bytes_ = order_.capacity() * sizeof(order_.front());
}

std::uint64_t SurfelVoxels::key_of(const Eigen::Vector3d& local) const noexcept {
  const Eigen::Array3d index = (local / options_.edge()).array().floor() + double{ndt::kHalfRange};
  if (!((index >= 0.0).all() && (index <= double{ndt::kIndexEnd}).all())) return ndt::kNoVoxel;
  return ndt::key_of_shifted(static_cast<std::uint32_t>(index.x()),
                             static_cast<std::uint32_t>(index.y()),
                             static_cast<std::uint32_t>(index.z()));
}

std::vector<std::uint32_t> SurfelVoxels::surfels_at(const SurfelMap& map, PointsView seen) const {
  if (!seen.empty()) std::call_once(made_, [&] { make(map); });
  const bool thinned = options_.voxel > 0.0;
  std::vector<bool> belongs(map.points().size(), false);
  std::uint64_t last = ndt::kNoVoxel;
  auto begin = order_.end(), end = begin;  // of the last voxel
  for (const Point& p : seen) {
    const Eigen::Vector3d local = p - map.origin();
    const std::uint64_t key = key_of(local);
    if (key == ndt::kNoVoxel || (key == last && thinned)) continue;
    if (key != last) {
      last = key;
      begin = std::ranges::lower_bound(order_, std::pair(key, std::uint32_t{0}));
      for (end = begin; end != order_.end() && end->first == key;) ++end;
    }
    for (auto at = begin; at != end; ++at) {
      if (thinned || (map.points()[at->second] - local).norm() <= kSamePlace) {
        belongs[at->second] = true;
      }
    }
  }
  return numbers_of(belongs);
}

}  // namespace vantage::matching
