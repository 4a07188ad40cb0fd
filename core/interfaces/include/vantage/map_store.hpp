#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "vantage/api.hpp"
#include "vantage/partition.hpp"
#include "vantage/point_cloud.hpp"
#include "vantage/prepared_map.hpp"
#include "vantage/result.hpp"

namespace vantage {

/// V_ij: the observable points of one region (Eq. 10), or what a matcher made of them, or both.
struct RegionMap {
  PointCloud points;      ///< map frame [m]
  PointCloud viewpoints;  ///< that it was seen from, map frame [m]: where a sensor may be
  PreparedMap prepared;   ///< no bytes if none was stored
  /// From how many of the viewpoints each point is seen, 1 or more; empty if that was not stored.
  std::vector<std::uint32_t> views = {};
};

/// The largest of a map's views; 0 if it has none.
/// Errors: `invalid_input` for views that are not one for each point, or 0.
[[nodiscard]] VANTAGE_API Result<std::uint32_t> max_views_of(const RegionMap& map);

/// What the index of a bundle says of one region.
struct RegionSummary {
  std::uint64_t points = 0;      ///< stored
  std::uint64_t viewpoints = 0;  ///< stored
  std::uint64_t elements = 0;    ///< of the prepared map
  std::uint64_t bytes = 0;       ///< size in storage
  std::uint32_t max_views = 0;   ///< the largest of the stored views; 0 if there are none

  /// Whether there is anything to match against.
  [[nodiscard]] bool empty() const noexcept { return points == 0 && elements == 0; }
};

/// The table of contents of a bundle: everything but the points.
struct MapIndex {
  Partition partition;
  std::vector<RegionSummary> regions;  ///< by RegionId; a store fills it from `put`
  Bounds3 map_bounds;                  ///< of the wide-area map
  std::uint64_t map_points = 0;        ///< N of the wide-area map
  std::string config;                  ///< the effective configuration that built it (TOML)
};

/// Keeps region maps. A bundle is written with begin, put for every region, commit; it exists only
/// after commit. Destroying a store between begin and commit leaves nothing behind. What is stored
/// depends on the bundle alone: not on the place, the time, or the order of the puts.
/// Thread safety: const methods from many threads at once; begin, put, commit from one.
class VANTAGE_API MapStore {
 public:
  virtual ~MapStore();

  /// Errors: `already_exists` if the bundle is there, `io_failure`.
  [[nodiscard]] virtual Result<void> begin(const MapIndex& index) noexcept = 0;
  /// Errors: `not_found` for a region outside the index, `already_exists` for one put twice,
  /// `invalid_input` without begin, for a non-finite point or viewpoint, and for views that are not
  /// one for each point or 0; `io_failure`.
  [[nodiscard]] virtual Result<void> put(RegionId region, const RegionMap& map) noexcept = 0;
  /// Makes the bundle visible, all at once. Errors: `invalid_input` without begin or with a region
  /// missing, `io_failure`.
  [[nodiscard]] virtual Result<void> commit() noexcept = 0;

  /// Errors: `not_found` without a bundle, `corrupt_data` for a damaged index.
  [[nodiscard]] virtual Result<MapIndex> index() const noexcept = 0;
  /// The map of one region: points and viewpoints in the order they were put, to the precision that
  /// the store declares; views and prepared bytes as they were. Errors: `not_found` for an unknown
  /// region or no bundle, `corrupt_data` for a damaged file.
  [[nodiscard]] virtual Result<RegionMap> get(RegionId region) const noexcept = 0;
};

}  // namespace vantage
