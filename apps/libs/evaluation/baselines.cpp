#include "vantage/evaluation/baselines.hpp"

#include <tbb/blocked_range.h>
#include <tbb/parallel_for.h>

#include <algorithm>
#include <bit>
#include <cmath>
#include <limits>
#include <nanoflann.hpp>
#include <utility>

#include "vantage/engine/atlas.hpp"
#include "vantage/kit/directory_of.hpp"
#include "vantage/kit/hash.hpp"
#include "vantage/kit/kd_tree_points.hpp"
#include "vantage/kit/voxel_sizes.hpp"
#include "vantage/plugin.hpp"

namespace vantage {
namespace {

/// The random number of a point; the order of these numbers is that of a random permutation.
std::uint64_t draw(const Point& p) {
  return hash(0, std::bit_cast<std::uint64_t>(p.x()), std::bit_cast<std::uint64_t>(p.y()),
              std::bit_cast<std::uint64_t>(p.z()));
}

/// f(i) for every i below `count`, in parallel.
template <class F>
auto for_each_index(std::size_t count, const F& f) {
  std::vector<std::invoke_result_t<F, std::size_t>> results(count);
  tbb::parallel_for(tbb::blocked_range<std::size_t>(0, count), [&](const auto& range) {
    for (std::size_t i = range.begin(); i != range.end(); ++i) results[i] = f(i);
  });
  return results;
}

/// The `count` candidates with the smallest keys, strictly ascending as indices.
template <class Key>
IndexList least(const IndexList& candidates, const std::vector<Key>& keys, std::size_t count) {
  if (candidates.size() <= count) return candidates;
  std::vector<std::pair<Key, std::uint32_t>> order(candidates.size());
  for (std::size_t i = 0; i < order.size(); ++i) order[i] = {keys[i], candidates[i]};
  std::nth_element(order.begin(), order.begin() + static_cast<std::ptrdiff_t>(count), order.end());
  IndexList chosen(count);
  for (std::size_t i = 0; i < count; ++i) chosen[i] = order[i].second;
  std::sort(chosen.begin(), chosen.end());
  return chosen;
}

/// The candidate with the smallest random number in each voxel.
IndexList one_a_voxel(PointsView map, const IndexList& candidates, double size) {
  struct Drawn {
    std::uint64_t voxel, draw;
    std::uint32_t index;
    auto operator<=>(const Drawn&) const = default;
  };
  const std::vector<std::uint64_t> voxels = voxels_of(map, candidates, size);
  auto drawn = for_each_index(candidates.size(), [&](std::size_t i) {
    return Drawn{voxels[i], draw(map[candidates[i]]), candidates[i]};
  });
  std::sort(drawn.begin(), drawn.end());
  IndexList chosen;
  for (std::size_t i = 0; i < drawn.size(); ++i) {
    if (i == 0 || drawn[i].voxel != drawn[i - 1].voxel) chosen.push_back(drawn[i].index);
  }
  std::sort(chosen.begin(), chosen.end());
  return chosen;
}

using Viewpoints = KdTreePoints<Point>;
using Tree = nanoflann::KDTreeSingleIndexAdaptor<nanoflann::L2_Simple_Adaptor<double, Viewpoints>,
                                                 Viewpoints, 3, std::uint32_t>;

}  // namespace

std::string_view to_string(Thinning thinning) noexcept {
  switch (thinning) {
    case Thinning::random: return "random";
    case Thinning::voxel: return "voxel";
    case Thinning::radius: return "radius";
  }
  return "";
}

Reach reach_of(PointsView map, PointsView viewpoints, const VisibilityConfig& visibility,
               const Partition& partition, RegionId region) {
  if (viewpoints.empty()) return {};
  const double range = visibility.max_range.value_or(std::numeric_limits<double>::infinity());
  const Bounds3 around = bounds_of(viewpoints);
  const Viewpoints cloud{viewpoints};
  const Tree tree(3, cloud);
  constexpr double kOutside = -1.0;
  const std::vector<double> squared = for_each_index(map.size(), [&](std::size_t i) {
    const Point& p = map[i];
    const Point gap = (around.min - p).cwiseMax(p - around.max).cwiseMax(Point::Zero());
    if (gap.squaredNorm() > range * range) return kOutside;
    std::uint32_t nearest = 0;
    double distance = 0.0;
    tree.knnSearch(p.data(), 1, &nearest, &distance);
    if (distance > range * range) return kOutside;
    if (visibility.scope == VisibilityScope::region && partition.locate(p) != region) {
      return kOutside;
    }
    return distance;
  });
  Reach reach;
  for (std::uint32_t i = 0; i < map.size(); ++i) {
    if (squared[i] < 0.0) continue;
    reach.indices.push_back(i);
    reach.squared.push_back(squared[i]);
  }
  return reach;
}

IndexList random_thinning(PointsView map, const IndexList& candidates, std::size_t count) {
  return least(
      candidates,
      for_each_index(candidates.size(), [&](std::size_t i) { return draw(map[candidates[i]]); }),
      count);
}

IndexList voxel_thinning(PointsView map, const IndexList& candidates, std::size_t count) {
  if (candidates.size() <= count) return candidates;
  const double size = voxel_sizes_around(map, candidates, count).enough;
  IndexList even = one_a_voxel(map, candidates, size);
  if (even.size() < count) even = candidates;  // many points at one place
  return random_thinning(map, even, count);
}

IndexList radius_crop(const Reach& candidates, std::size_t count) {
  return least(candidates.indices, candidates.squared, count);
}

BaselineMaps::Chosen BaselineMaps::choose(RegionId region, const RegionMap& original) const {
  const Reach reach = reach_of(map_, original.viewpoints, visibility_, index_.partition, region);
  const std::size_t count = original.points.size();
  Chosen chosen;
  for (const Thinning thinning : kThinnings) {
    IndexList& indices = chosen[static_cast<std::size_t>(thinning)];
    switch (thinning) {
      case Thinning::random: indices = random_thinning(map_, reach.indices, count); break;
      case Thinning::voxel: indices = voxel_thinning(map_, reach.indices, count); break;
      case Thinning::radius: indices = radius_crop(reach, count); break;
    }
  }
  return chosen;
}

Result<RegionMap> BaselineMaps::get(RegionId region, Thinning thinning) const {
  VANTAGE_TRY(RegionMap map, original_.get(region));
  const std::lock_guard lock(mutex_);
  auto made = made_.find(region.value);
  if (made == made_.end()) made = made_.emplace(region.value, choose(region, map)).first;
  map.points.clear();
  for (const std::uint32_t i : made->second[static_cast<std::size_t>(thinning)]) {
    map.points.push_back(map_[i]);
  }
  map.prepared = {};  // made from the original's points
  map.views = {};
  return map;
}

Result<bool> BaselineMaps::holds_everything(RegionId region) const {
  VANTAGE_TRY(const RegionMap map, original_.get(region));
  const Reach reach = reach_of(map_, map.viewpoints, visibility_, index_.partition, region);
  return map.points.size() >= reach.indices.size();
}

Result<MapIndex> BaselineReader::index() const noexcept {
  return guarded([&]() -> Result<MapIndex> {
    MapIndex index = maps_.index();
    for (RegionSummary& region : index.regions) region.bytes = 0;  // they are on no disk
    return index;
  });
}
Result<std::unique_ptr<const RegionDirectory>> BaselineReader::directory() const noexcept {
  return guarded([&] { return index().and_then(directory_of); });
}
Result<RegionMap> BaselineReader::get(RegionId region) const noexcept {
  return guarded([&] { return maps_.get(region, thinning_); });
}
Result<std::vector<std::byte>> BaselineReader::attachment(std::string_view name) const noexcept {
  return name == Atlas::kAttachment ? MapReader::attachment(name)
                                    : maps_.original().attachment(name);
}

}  // namespace vantage
