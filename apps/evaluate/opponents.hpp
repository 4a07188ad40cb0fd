#pragma once

#include <array>
#include <cstddef>
#include <map>
#include <memory>
#include <mutex>
#include <string_view>

#include "vantage/config.hpp"
#include "vantage/map_store.hpp"
#include "vantage/plugin_loader.hpp"
#include "vantage/point_cloud.hpp"
#include "vantage/result.hpp"
#include "vantage/visibility.hpp"

namespace vantage {

/// Ways to make a region map small without asking what can be seen.
enum class Thinning : std::uint8_t {
  random,  ///< points drawn at random
  voxel,   ///< one point a voxel, drawn at random
  radius,  ///< the points nearest to a viewpoint
};
inline constexpr std::array kThinnings{Thinning::random, Thinning::voxel, Thinning::radius};
[[nodiscard]] std::string_view to_string(Thinning) noexcept;

/// `count` of the candidates, drawn at random: by a hash of their coordinates, so the draw depends
/// neither on their order nor on chance.
/// @param candidates  indices into `map`, strictly ascending
/// @return            strictly ascending; all candidates if there are no more than `count`
[[nodiscard]] IndexList random_thinning(PointsView map, const IndexList& candidates,
                                        std::size_t count);

/// One candidate a voxel, the voxels as large as leaves at least `count`; the last few too many are
/// drawn out at random. Arguments and result as above.
[[nodiscard]] IndexList voxel_thinning(PointsView map, const IndexList& candidates,
                                       std::size_t count);

/// The candidates that are nearest to a viewpoint. Arguments and result as above.
/// @param viewpoints  map frame [m], at least one
[[nodiscard]] IndexList radius_crop(PointsView map, const IndexList& candidates,
                                    PointsView viewpoints, std::size_t count);

/// What a sensor could reach from the viewpoints of a region if nothing stood in its way.
class Reach {
 public:
  /// @param map         borrowed
  /// @param visibility  of the configuration: its range, and whether only P_ij counts
  [[nodiscard]] static Result<Reach> over(PointsView map, const VisibilityConfig& visibility,
                                          const PluginLoader& loader);

  [[nodiscard]] PointsView map() const noexcept { return map_; }
  /// Indices into the map of the points at most `max_range` from a viewpoint, strictly ascending.
  [[nodiscard]] Result<IndexList> candidates(const Partition& partition, RegionId region,
                                             const PointCloud& viewpoints) const;

 private:
  Reach(PointsView map, VisibilityScope scope, PluginPtr<VisibilityScene> everything)
      : map_(map), scope_(scope), everything_(std::move(everything)) {}

  PointsView map_;
  VisibilityScope scope_;
  PluginPtr<VisibilityScene> everything_;  // that nothing occludes
};

/// The region maps of another store, each with as many points as there but chosen by a thinning of
/// what the sensor can reach. They are made when they are asked for, and kept.
/// Thread safety: `get` may run from several threads at once.
class ThinnedRegions {
 public:
  /// @param original, reach  borrowed
  /// @param index            of `original`
  ThinnedRegions(const MapStore& original, MapIndex index, const Reach& reach, Thinning thinning)
      : original_(original), index_(std::move(index)), reach_(reach), thinning_(thinning) {}

  [[nodiscard]] const MapIndex& index() const noexcept { return index_; }
  [[nodiscard]] Result<RegionMap> get(RegionId region) const;

 private:
  [[nodiscard]] Result<IndexList> chosen(RegionId region, const RegionMap& original) const;

  const MapStore& original_;
  MapIndex index_;
  const Reach& reach_;
  Thinning thinning_;
  mutable std::mutex mutex_;
  mutable std::map<std::uint32_t, IndexList> made_;  // by RegionId
};

/// They as a store, for a localizer to own; nothing can be put there.
class ThinnedStore final : public MapStore {
 public:
  explicit ThinnedStore(const ThinnedRegions& regions) : regions_(regions) {}

  Result<void> begin(const MapIndex&) noexcept override;
  Result<void> put(RegionId, const RegionMap&) noexcept override;
  Result<void> commit() noexcept override;
  [[nodiscard]] Result<MapIndex> index() const noexcept override;
  [[nodiscard]] Result<RegionMap> get(RegionId region) const noexcept override;

 private:
  const ThinnedRegions& regions_;
};

/// Whether a region map holds everything within reach: then there is nothing to choose.
[[nodiscard]] Result<bool> holds_everything(const MapStore& store, const Reach& reach,
                                            const Partition& partition, RegionId region);

}  // namespace vantage
