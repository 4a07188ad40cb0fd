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

/// Ways to make a region map smaller without visibility.
enum class Thinning : std::uint8_t {
  random,  ///< points drawn at random
  voxel,   ///< one point per voxel, drawn at random
  radius,  ///< the points nearest to a viewpoint
};
inline constexpr std::array kThinnings{Thinning::random, Thinning::voxel, Thinning::radius};
[[nodiscard]] std::string_view to_string(Thinning) noexcept;

/// The points that a sensor would see from a region's viewpoints if nothing blocked its view.
struct Reach {
  IndexList indices;            ///< into the wide-area map, strictly ascending
  std::vector<double> squared;  ///< squared distance of each to the nearest viewpoint [m^2]
};

/// Finds the points within reach of a region's viewpoints.
/// @param map         the wide-area map, map frame [m]
/// @param viewpoints  of `region`, map frame [m]; without viewpoints, no point is within reach
/// @param visibility  gives the sensor's range; its scope decides whether only P_ij counts
[[nodiscard]] Reach reach_of(PointsView map, PointsView viewpoints,
                             const VisibilityConfig& visibility, const Partition& partition,
                             RegionId region);

/// Draws `count` of the candidates pseudo-randomly, by a hash of their coordinates. The draw is
/// repeatable and does not depend on their order.
/// @param candidates  indices into `map`, strictly ascending
/// @return            strictly ascending; all candidates if there are at most `count`
[[nodiscard]] IndexList random_thinning(PointsView map, const IndexList& candidates,
                                        std::size_t count);

/// One candidate per voxel. The voxels are the largest (to about 1 %) that leave at least `count`
/// candidates; surplus candidates are removed at random. Arguments and result as above.
[[nodiscard]] IndexList voxel_thinning(PointsView map, const IndexList& candidates,
                                       std::size_t count);

/// The `count` candidates nearest to a viewpoint; result as above.
[[nodiscard]] IndexList radius_crop(const Reach& candidates, std::size_t count);

/// Replacements for the region maps of a bundle. Each has as many points as the original, chosen by
/// a Thinning from the points within reach. The first `get` of a region makes its replacements for
/// all thinnings and keeps them. Thread safety: `get` may run from several threads at once.
class BaselineMaps {
 public:
  /// @param original  the bundle; borrowed
  /// @param index     the index of `original`
  /// @param map       the wide-area map, map frame [m]; borrowed
  BaselineMaps(const MapReader& original, MapIndex index, PointsView map,
               VisibilityConfig visibility)
      : original_(original),
        index_(std::move(index)),
        map_(map),
        visibility_(std::move(visibility)) {}

  [[nodiscard]] const MapReader& original() const noexcept { return original_; }
  [[nodiscard]] const MapIndex& index() const noexcept { return index_; }
  [[nodiscard]] Result<RegionMap> get(RegionId region, Thinning thinning) const;
  /// Whether the region's own map has all points within reach, so that there is nothing to choose.
  [[nodiscard]] Result<bool> holds_everything(RegionId region) const;

 private:
  using Chosen = std::array<IndexList, kThinnings.size()>;
  [[nodiscard]] Chosen choose(RegionId region, const RegionMap& original) const;

  const MapReader& original_;
  MapIndex index_;
  PointsView map_;
  VisibilityConfig visibility_;
  mutable std::mutex mutex_;
  mutable std::map<std::uint32_t, Chosen> made_;  // by RegionId
};

/// The maps of one thinning as a bundle, which a localizer can own.
class BaselineReader final : public MapReader {
 public:
  /// @param maps  borrowed
  BaselineReader(const BaselineMaps& maps, Thinning thinning) : maps_(maps), thinning_(thinning) {}

  [[nodiscard]] Result<MapIndex> index() const noexcept override;
  [[nodiscard]] Result<std::unique_ptr<const RegionDirectory>> directory() const noexcept override;
  [[nodiscard]] Result<RegionMap> get(RegionId region) const noexcept override;
  /// That of the original, such as the index of places of the wide-area map. Without it, the first
  /// search would make the maps of all regions to index them. The atlas is of the original's maps.
  [[nodiscard]] Result<std::vector<std::byte>> attachment(
      std::string_view name) const noexcept override;

 private:
  const BaselineMaps& maps_;
  Thinning thinning_;
};

}  // namespace vantage
