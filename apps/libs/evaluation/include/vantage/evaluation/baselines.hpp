#pragma once

#include <array>
#include <cstddef>
#include <map>
#include <mutex>
#include <string_view>
#include <vector>

#include "vantage/engine/config.hpp"
#include "vantage/map_store.hpp"
#include "vantage/point_cloud.hpp"
#include "vantage/result.hpp"

namespace vantage {

/// Ways to make a region map small without asking what can be seen.
enum class Thinning : std::uint8_t {
  random,  ///< points drawn at random
  voxel,   ///< one point per voxel, drawn at random
  radius,  ///< the points nearest to a viewpoint
};
inline constexpr std::array kThinnings{Thinning::random, Thinning::voxel, Thinning::radius};
[[nodiscard]] std::string_view to_string(Thinning) noexcept;

/// What a sensor could reach from the viewpoints of a region if nothing blocked its view.
struct Reach {
  IndexList indices;            ///< into the wide-area map, strictly ascending
  std::vector<double> squared;  ///< squared distance of each to the nearest viewpoint [m^2]
};

/// @param map         the wide-area map [m]
/// @param viewpoints  of `region`, map frame [m]; without viewpoints, nothing is within reach
/// @param visibility  gives the sensor's range, and says whether only P_ij counts
[[nodiscard]] Reach reach_of(PointsView map, PointsView viewpoints,
                             const VisibilityConfig& visibility, const Partition& partition,
                             RegionId region);

/// Draws `count` of the candidates at random, by a hash of their coordinates: the draw depends
/// neither on their order nor on chance.
/// @param candidates  indices into `map`, strictly ascending
/// @return            strictly ascending; all candidates if there are at most `count`
[[nodiscard]] IndexList random_thinning(PointsView map, const IndexList& candidates,
                                        std::size_t count);

/// One candidate per voxel. The voxels are the largest that leave at least `count` candidates; the
/// few that are too many are removed at random. Arguments and result as above.
[[nodiscard]] IndexList voxel_thinning(PointsView map, const IndexList& candidates,
                                       std::size_t count);

/// The `count` candidates nearest to a viewpoint; result as above.
[[nodiscard]] IndexList radius_crop(const Reach& candidates, std::size_t count);

/// The region maps of a store, and in their place others with as many points, chosen by each
/// thinning of what the sensor can reach. Those of a region are made when one of them is asked for,
/// and kept. Thread safety: `get` may run from several threads at once.
class BaselineMaps {
 public:
  /// @param original, map  borrowed; `map` is the wide-area map
  /// @param index          of `original`
  BaselineMaps(const MapStore& original, MapIndex index, PointsView map,
               VisibilityConfig visibility)
      : original_(original),
        index_(std::move(index)),
        map_(map),
        visibility_(std::move(visibility)) {}

  [[nodiscard]] const MapIndex& index() const noexcept { return index_; }
  [[nodiscard]] Result<RegionMap> get(RegionId region, Thinning thinning) const;
  /// Whether the region's own map holds everything within reach, so that there is nothing to
  /// choose.
  [[nodiscard]] Result<bool> holds_everything(RegionId region) const;

 private:
  using Chosen = std::array<IndexList, kThinnings.size()>;
  [[nodiscard]] Chosen choose(RegionId region, const RegionMap& original) const;

  const MapStore& original_;
  MapIndex index_;
  PointsView map_;
  VisibilityConfig visibility_;
  mutable std::mutex mutex_;
  mutable std::map<std::uint32_t, Chosen> made_;  // by RegionId
};

/// The maps of one thinning as a store, for a localizer to own; nothing can be put there.
class BaselineStore final : public MapStore {
 public:
  /// @param maps  borrowed
  BaselineStore(const BaselineMaps& maps, Thinning thinning) : maps_(maps), thinning_(thinning) {}

  Result<void> begin(const MapIndex&) noexcept override;
  Result<void> put(RegionId, const RegionMap&) noexcept override;
  Result<void> commit() noexcept override;
  [[nodiscard]] Result<MapIndex> index() const noexcept override;
  [[nodiscard]] Result<RegionMap> get(RegionId region) const noexcept override;

 private:
  const BaselineMaps& maps_;
  Thinning thinning_;
};

}  // namespace vantage
