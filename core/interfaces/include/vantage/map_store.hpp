#pragma once

#include <cstddef>
#include <cstdint>
#include <memory>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "vantage/api.hpp"
#include "vantage/partition.hpp"
#include "vantage/point_cloud.hpp"
#include "vantage/prepared_map.hpp"
#include "vantage/result.hpp"

namespace vantage {

/// V_ij of one region (Eq. 10): its observable points, a matcher's excerpt around them, or both.
struct RegionMap {
  PointCloud points;      ///< map frame [m]
  PointCloud viewpoints;  ///< that saw the points, map frame [m]: places where a sensor may be
  PreparedMap prepared;   ///< no bytes if none was stored
  /// How many of the viewpoints see each point, 1 or more; empty if these counts were not stored.
  std::vector<std::uint32_t> views = {};
};

/// The largest of a map's view counts; 0 if it has none.
/// Errors: `invalid_input` if there is not one count per point, or if a count is 0.
[[nodiscard]] VANTAGE_API Result<std::uint32_t> max_views_of(const RegionMap& map);

class RegionDirectory;

/// What the index of a bundle says about one region.
struct RegionSummary {
  std::uint64_t points = 0;      ///< number of stored points
  std::uint64_t viewpoints = 0;  ///< number of stored viewpoints
  std::uint64_t elements = 0;    ///< number of elements of the prepared map
  std::uint64_t bytes = 0;       ///< size in storage
  std::uint32_t max_views = 0;   ///< the largest of the stored view counts; 0 if there are none

  /// Whether there is anything to match against.
  [[nodiscard]] bool empty() const noexcept { return points == 0 && elements == 0; }
};

/// The table of contents of a bundle: everything but the points.
struct MapIndex {
  Partition partition;
  std::vector<RegionSummary> regions;  ///< by RegionId; a store fills them in on `put`
  Bounds3 map_bounds;                  ///< of the wide-area map
  std::uint64_t map_points = 0;        ///< N of the wide-area map
  std::string config;                  ///< effective configuration of the build (TOML)
};

/// Stores region maps as a bundle. A bundle is written with begin, one put per region, and commit.
/// It exists only after commit: destroying a store between begin and commit leaves nothing behind.
/// What is stored depends only on the bundle, not on the place, the time or the order of the puts.
/// It reads from one bundle only: `io_failure` if another one has taken its place since.
/// Thread safety: const methods from many threads at once; begin, put and commit from one thread.
class VANTAGE_API MapStore {
 public:
  virtual ~MapStore();

  /// What `begin` would refuse, before a long build computes anything. Changes nothing; the default
  /// refuses nothing. Errors: `already_exists`; `unsupported` (it only reads); `io_failure`.
  [[nodiscard]] virtual Result<void> may_begin() const noexcept { return {}; }
  /// Errors: `already_exists` if the bundle exists; `io_failure`.
  [[nodiscard]] virtual Result<void> begin(const MapIndex& index) noexcept = 0;
  /// Errors: `not_found` for a region outside the index; `already_exists` for a second put of a
  /// region; `invalid_input` without begin, for a non-finite point or viewpoint, and for view
  /// counts that are 0 or not one per point; `io_failure`.
  [[nodiscard]] virtual Result<void> put(RegionId region, const RegionMap& map) noexcept = 0;
  /// Keeps bytes under a name, beside the regions: what the engine computed about the whole map.
  /// Without begin, a bundle that is there gets them at once, whole, in place of earlier ones.
  /// @param name  lower-case letters and underscores, at most 32
  /// Errors: `unsupported` (the default) from a store that keeps regions only; `already_exists` for
  /// a second time in one build; `not_found` without begin and without a bundle; `invalid_input`
  /// for another name; `io_failure`.
  [[nodiscard]] virtual Result<void> attach(std::string_view name,
                                            std::span<const std::byte> bytes) noexcept;
  /// Makes the whole bundle visible at once. When it returns, the bundle survives a power cut.
  /// Errors: `invalid_input` without begin or if a region is missing; `io_failure`.
  [[nodiscard]] virtual Result<void> commit() noexcept = 0;

  /// Errors: `not_found` if there is no bundle, `corrupt_data` for a damaged index.
  [[nodiscard]] virtual Result<MapIndex> index() const noexcept = 0;
  /// The regions, each read when it is asked for; usable without the store. Errors: those of
  /// `index`; `unsupported` (the default): the caller then reads the whole index.
  [[nodiscard]] virtual Result<std::unique_ptr<const RegionDirectory>> directory() const noexcept;
  /// The map of one region. Points and viewpoints come back in the order of `put`, in the precision
  /// that the store declares. View counts and prepared bytes come back unchanged.
  /// Errors: `not_found` for an unknown region or without a bundle; `corrupt_data`.
  [[nodiscard]] virtual Result<RegionMap> get(RegionId region) const noexcept = 0;
  /// The bytes of that name, unchanged.
  /// Errors: `not_found` (the default) if there are none; `corrupt_data` for a damaged file.
  [[nodiscard]] virtual Result<std::vector<std::byte>> attachment(
      std::string_view name) const noexcept;
};

}  // namespace vantage
