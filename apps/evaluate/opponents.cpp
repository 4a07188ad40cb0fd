#include "evaluate/opponents.hpp"

#include <tbb/blocked_range.h>
#include <tbb/parallel_for.h>

#include <algorithm>
#include <bit>
#include <cmath>
#include <limits>
#include <nanoflann.hpp>
#include <unordered_set>

#include "common/hash.hpp"

namespace vantage {
namespace {

/// What a point draws: the order of the draws is that of a random permutation.
std::uint64_t draw(const Point& p) {
  return hash(0, std::bit_cast<std::uint64_t>(p.x()), std::bit_cast<std::uint64_t>(p.y()),
              std::bit_cast<std::uint64_t>(p.z()));
}

/// The `count` candidates with the least keys, strictly ascending as indices.
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

/// The voxel of each candidate, as a hash of 64 bits: two voxels of one map that share it are next
/// to impossible, and would cost one point.
std::uint64_t voxel_of(const Point& p, double size) {
  const auto cell = [&](double x) {
    return static_cast<std::uint64_t>(static_cast<std::int64_t>(std::floor(x / size)));
  };
  return hash(0, cell(p.x()), cell(p.y()), cell(p.z()));
}

/// How many voxels the candidates are in; counting ends above `enough`.
std::size_t count_voxels(PointsView map, const IndexList& candidates, double size,
                         std::size_t enough) {
  std::unordered_set<std::uint64_t> voxels;
  voxels.reserve(std::min(candidates.size(), enough) + 1);
  for (const std::uint32_t i : candidates) {
    if (voxels.insert(voxel_of(map[i], size)).second && voxels.size() > enough) break;
  }
  return voxels.size();
}

/// Of each voxel the candidate with the least draw.
IndexList one_a_voxel(PointsView map, const IndexList& candidates, double size) {
  struct Drawn {
    std::uint64_t voxel, draw;
    std::uint32_t index;
    auto operator<=>(const Drawn&) const = default;
  };
  std::vector<Drawn> drawn(candidates.size());
  tbb::parallel_for(std::size_t{0}, candidates.size(), [&](std::size_t i) {
    const Point& p = map[candidates[i]];
    drawn[i] = {voxel_of(p, size), draw(p), candidates[i]};
  });
  std::sort(drawn.begin(), drawn.end());
  IndexList chosen;
  for (std::size_t i = 0; i < drawn.size(); ++i) {
    if (i == 0 || drawn[i].voxel != drawn[i - 1].voxel) chosen.push_back(drawn[i].index);
  }
  std::sort(chosen.begin(), chosen.end());
  return chosen;
}

struct CloudAdaptor {
  PointsView points;
  [[nodiscard]] std::size_t kdtree_get_point_count() const { return points.size(); }
  [[nodiscard]] double kdtree_get_pt(std::size_t i, std::size_t axis) const {
    return points[i][static_cast<Eigen::Index>(axis)];
  }
  template <class Box>
  bool kdtree_get_bbox(Box&) const {
    return false;
  }
};
using Tree = nanoflann::KDTreeSingleIndexAdaptor<nanoflann::L2_Simple_Adaptor<double, CloudAdaptor>,
                                                 CloudAdaptor, 3, std::uint32_t>;

tl::unexpected<Error> read_only() {
  return fail(ErrorCode::unsupported, "this store makes its maps itself; nothing can be put there");
}

}  // namespace

std::string_view to_string(Thinning thinning) noexcept {
  switch (thinning) {
    case Thinning::random: return "random";
    case Thinning::voxel: return "voxel";
    case Thinning::radius: return "radius";
  }
  return "";
}

IndexList random_thinning(PointsView map, const IndexList& candidates, std::size_t count) {
  std::vector<std::uint64_t> draws(candidates.size());
  tbb::parallel_for(std::size_t{0}, candidates.size(),
                    [&](std::size_t i) { draws[i] = draw(map[candidates[i]]); });
  return least(candidates, draws, count);
}

IndexList voxel_thinning(PointsView map, const IndexList& candidates, std::size_t count) {
  if (candidates.size() <= count) return candidates;
  // The number of voxels falls with their size, not quite steadily: any size whose neighbours leave
  // too few will do.
  double few = 1.0, enough = 1.0;
  while (count_voxels(map, candidates, few, count) >= count && few < 1e6) few *= 2.0;
  while (count_voxels(map, candidates, enough, count) < count && enough > 1e-6) enough /= 2.0;
  if (few < enough) few = 2.0 * enough;
  for (int halving = 0; halving < 12; ++halving) {
    const double middle = std::sqrt(few * enough);
    (count_voxels(map, candidates, middle, count) >= count ? enough : few) = middle;
  }
  IndexList even = one_a_voxel(map, candidates, enough);
  if (even.size() < count) even = candidates;  // many points at one place
  return random_thinning(map, even, count);
}

IndexList radius_crop(PointsView map, const IndexList& candidates, PointsView viewpoints,
                      std::size_t count) {
  if (candidates.size() <= count) return candidates;
  const CloudAdaptor cloud{viewpoints};
  const Tree tree(3, cloud);
  std::vector<double> squared(candidates.size());
  tbb::parallel_for(tbb::blocked_range<std::size_t>(0, candidates.size()), [&](const auto& range) {
    for (std::size_t i = range.begin(); i != range.end(); ++i) {
      std::uint32_t nearest = 0;
      tree.knnSearch(map[candidates[i]].data(), 1, &nearest, &squared[i]);
    }
  });
  return least(candidates, squared, count);
}

Result<Reach> Reach::over(PointsView map, const VisibilityConfig& visibility,
                          const PluginLoader& loader) {
  PluginChoice choice;
  choice.plugin = "keep_all";
  VANTAGE_TRY(const auto keep_all, loader.load<VisibilityOperator>(choice));
  const VisibilityLimits limits{
      .map_bounds = bounds_of(map),
      .max_range = visibility.max_range.value_or(std::numeric_limits<double>::infinity())};
  VANTAGE_TRY(auto scene, keep_all->prepare(map, limits));
  return Reach(map, visibility.scope, in_library_of(keep_all, std::move(scene)));
}

Result<IndexList> Reach::candidates(const Partition& partition, RegionId region,
                                    const PointCloud& viewpoints) const {
  VANTAGE_TRY(IndexList reached, everything_->visible_from_any(viewpoints));
  if (scope_ == VisibilityScope::region) {
    std::erase_if(reached, [&](std::uint32_t i) { return partition.locate(map_[i]) != region; });
  }
  return reached;
}

Result<IndexList> ThinnedRegions::chosen(RegionId region, const RegionMap& original) const {
  {
    const std::lock_guard lock(mutex_);
    if (const auto made = made_.find(region.value); made != made_.end()) return made->second;
  }
  VANTAGE_TRY(const IndexList candidates,
              reach_.candidates(index_.partition, region, original.viewpoints));
  const std::size_t count = original.points.size();
  IndexList indices;
  switch (thinning_) {
    case Thinning::random: indices = random_thinning(reach_.map(), candidates, count); break;
    case Thinning::voxel: indices = voxel_thinning(reach_.map(), candidates, count); break;
    case Thinning::radius:
      indices = radius_crop(reach_.map(), candidates, original.viewpoints, count);
      break;
  }
  const std::lock_guard lock(mutex_);
  return made_.emplace(region.value, std::move(indices)).first->second;
}

Result<RegionMap> ThinnedRegions::get(RegionId region) const {
  VANTAGE_TRY(RegionMap map, original_.get(region));
  VANTAGE_TRY(const IndexList indices, chosen(region, map));
  map.points.clear();
  map.points.reserve(indices.size());
  for (const std::uint32_t i : indices) map.points.push_back(reach_.map()[i]);
  map.prepared = {};  // of the original's points
  return map;
}

Result<void> ThinnedStore::begin(const MapIndex&) noexcept { return read_only(); }
Result<void> ThinnedStore::put(RegionId, const RegionMap&) noexcept { return read_only(); }
Result<void> ThinnedStore::commit() noexcept { return read_only(); }
Result<MapIndex> ThinnedStore::index() const noexcept {
  return guarded([&]() -> Result<MapIndex> { return regions_.index(); });
}
Result<RegionMap> ThinnedStore::get(RegionId region) const noexcept {
  return guarded([&] { return regions_.get(region); });
}

Result<bool> holds_everything(const MapStore& store, const Reach& reach, const Partition& partition,
                              RegionId region) {
  VANTAGE_TRY(const RegionMap map, store.get(region));
  VANTAGE_TRY(const IndexList candidates, reach.candidates(partition, region, map.viewpoints));
  return map.points.size() >= candidates.size();
}

}  // namespace vantage
