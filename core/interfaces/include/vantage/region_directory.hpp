#pragma once

#include <cstdint>
#include <memory>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "vantage/api.hpp"
#include "vantage/map_store.hpp"
#include "vantage/partition.hpp"
#include "vantage/result.hpp"

namespace vantage {

/// What a bundle says about itself and about all its regions together.
struct BundleSummary {
  std::uint64_t regions = 0;
  std::uint64_t empty_regions = 0;                  ///< with nothing to match against
  std::uint64_t without_points = 0;                 ///< regions that hold no point, empty or not
  Bounds2 extent;                                   ///< of all footprints [m]
  Bounds3 map_bounds;                               ///< of the wide-area map [m]
  std::uint64_t map_points = 0;                     ///< N of the wide-area map
  std::uint64_t least_points = 0, most_points = 0;  ///< of a region
  RegionSummary sum;                                ///< of all regions; of `max_views`, the largest
  std::string config;                               ///< effective configuration of the build (TOML)
};

/// A region, and what the index says about its map.
struct DirectoryEntry {
  Region region;
  RegionSummary summary;
};

/// The regions of a bundle, of which there may be millions: nothing but the summary is held, and
/// what is asked for is read. Its answers are those of the bundle's Partition.
/// Thread safety: all methods may run on one object from many threads at once.
class VANTAGE_API RegionDirectory {
 public:
  RegionDirectory() = default;
  RegionDirectory(const RegionDirectory&) = delete;
  RegionDirectory& operator=(const RegionDirectory&) = delete;
  virtual ~RegionDirectory();

  [[nodiscard]] virtual const BundleSummary& summary() const noexcept = 0;
  /// Errors: `not_found` for a region that the bundle does not have; `corrupt_data`; `io_failure`.
  [[nodiscard]] virtual Result<DirectoryEntry> entry(RegionId region) const noexcept = 0;
  /// The regions whose rectangles (`bounds_of` of the footprint) meet a rectangle, in ascending
  /// order. Errors: `corrupt_data`; `io_failure`.
  [[nodiscard]] virtual Result<std::vector<RegionId>> meeting(
      const Bounds2& area) const noexcept = 0;
  /// The region of that label. Errors: `corrupt_data`; `io_failure`.
  [[nodiscard]] virtual Result<std::optional<RegionId>> find(
      std::string_view label) const noexcept = 0;
};

}  // namespace vantage
