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
  std::vector<RegionSummary> regions;  ///< by RegionId
  Bounds3 map_bounds;                  ///< of the wide-area map
  std::uint64_t map_points = 0;        ///< N of the wide-area map
  std::string config;                  ///< effective configuration of the build (TOML)
};

/// A bundle under way. It exists only after commit: destroying a writer before leaves nothing
/// behind. What is stored depends only on the bundle, not on the place, the time or the order of
/// the puts. One thread uses a writer.
class VANTAGE_API MapWriter {
 public:
  virtual ~MapWriter();

  /// Errors: `not_found` for a region outside the index; `already_exists` for a second put of a
  /// region; `invalid_input` for a non-finite point or viewpoint, and for view counts that are 0 or
  /// not one per point: the region can still be put; `io_failure`.
  [[nodiscard]] virtual Result<void> put(RegionId region, const RegionMap& map) noexcept = 0;
  /// Keeps bytes under a name, beside the regions: what the engine computed about the whole map.
  /// @param name  lower-case letters and underscores, at most 32
  /// Errors: `unsupported` (the default) from a store that keeps regions only; `already_exists` for
  /// a second time; `invalid_input` for another name; `io_failure`.
  [[nodiscard]] virtual Result<void> attach(std::string_view name,
                                            std::span<const std::byte> bytes) noexcept;
  /// Makes the whole bundle visible at once, and is the last call. When it returns, the bundle
  /// survives a power cut. Errors: `invalid_input` if a region is missing; `already_exists`;
  /// `io_failure`.
  [[nodiscard]] virtual Result<void> commit() && noexcept = 0;
};

/// One bundle, opened for reading. It never answers from another one that has taken the place of
/// the bundle since: it reads on, or fails with `io_failure`.
/// Thread safety: all methods may run on one object from many threads at once.
class VANTAGE_API MapReader {
 public:
  virtual ~MapReader();

  /// All regions at once, checked as a whole. Errors: `corrupt_data`; `io_failure`.
  [[nodiscard]] virtual Result<MapIndex> index() const noexcept = 0;
  /// The regions, each read when it is asked for; usable without the reader. Of few regions,
  /// `directory_of(index)` of the kit holds them all. Errors: those of `index`.
  [[nodiscard]] virtual Result<std::unique_ptr<const RegionDirectory>> directory()
      const noexcept = 0;
  /// The map of one region. Points and viewpoints come back in the order of `put`, in the precision
  /// that the store declares. View counts and prepared bytes come back unchanged.
  /// Errors: `not_found` for an unknown region; `corrupt_data`; `io_failure`.
  [[nodiscard]] virtual Result<RegionMap> get(RegionId region) const noexcept = 0;
  /// The bytes of that name, unchanged.
  /// Errors: `not_found` (the default) if there are none; `corrupt_data` for a damaged file.
  [[nodiscard]] virtual Result<std::vector<std::byte>> attachment(
      std::string_view name) const noexcept;
  /// Adds bytes to the bundle, whole and at once, in place of earlier ones of that name.
  /// @param name  as of MapWriter::attach
  /// Errors: `unsupported` (the default); `invalid_input` for another name; `io_failure`.
  [[nodiscard]] virtual Result<void> attach(std::string_view name,
                                            std::span<const std::byte> bytes) const noexcept;
};

/// The place of a bundle of region maps.
class VANTAGE_API MapStore {
 public:
  virtual ~MapStore();

  /// What `begin` would refuse, before a long build computes anything. Changes nothing; the default
  /// refuses nothing. Errors: `already_exists`; `unsupported` (it only reads); `io_failure`.
  [[nodiscard]] virtual Result<void> may_begin() const noexcept { return {}; }
  /// Begins a bundle. The writer is usable without the store.
  /// @param index  of the bundle; its summaries do not count: the writer makes them
  /// Errors: `already_exists` if there is a bundle; `unsupported`; `io_failure`.
  [[nodiscard]] virtual Result<std::unique_ptr<MapWriter>> begin(
      const MapIndex& index) const noexcept = 0;
  /// Opens the bundle. The reader is usable without the store.
  /// Errors: `not_found` if there is none; `corrupt_data`; `io_failure`.
  [[nodiscard]] virtual Result<std::unique_ptr<const MapReader>> open() const noexcept = 0;
};

}  // namespace vantage
