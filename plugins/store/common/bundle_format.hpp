#pragma once

#include <cstdint>
#include <functional>
#include <string>
#include <string_view>

#include "vantage/map_store.hpp"
#include "vantage/partition.hpp"
#include "vantage/point_cloud.hpp"
#include "vantage/result.hpp"

/// What stores share that keep a bundle in a folder: a head, the regions, one file per region,
/// attachments.
namespace vantage::bundle_folder {

/// What a bundle says about the file of one region.
struct RegionFile {
  std::uint64_t points = 0;
  std::uint64_t viewpoints = 0;
  std::uint64_t elements = 0;        ///< of the prepared map
  std::uint64_t prepared_bytes = 0;  ///< of the prepared map, without the padding
  Point origin = Point::Zero();      ///< map frame [m]; the file holds coordinates relative to it
  std::uint64_t bytes = 0;           ///< of the whole file
  std::uint64_t checksum = 0;        ///< XXH64; the store says over what
  std::uint32_t max_views = 0;       ///< 0: the points have no view counts

  [[nodiscard]] RegionSummary summary() const noexcept {
    return {.points = points,
            .viewpoints = viewpoints,
            .elements = elements,
            .bytes = bytes,
            .max_views = max_views};
  }
};

/// A region as the bundle has it.
struct IndexedRegion {
  Region region;
  RegionFile file;
};

inline constexpr std::uint64_t kMostRegions = 0xffff'fffeU;
inline constexpr std::uint64_t kMaxPoints = std::uint64_t{1} << 40U;         ///< the limit for
                                                                             ///< viewpoints, too
inline constexpr std::uint64_t kMaxPreparedBytes = std::uint64_t{1} << 50U;  ///< of a region

/// The counts of a map that can be stored, and an origin for its coordinates: the centre of its
/// points, or of its viewpoints if there are no points, rounded to whole metres. Size and checksum
/// are for the store to fill in.
/// Errors: `invalid_input` for a coordinate that is not finite or too far from the others for
/// float32, for view counts that are 0 or not one per point, and for elements without bytes.
[[nodiscard]] Result<RegionFile> checked(const RegionMap& map);

/// What distinguishes the bundles of one store from those of another.
struct BundleFormat {
  std::string_view store;         ///< the name of the plugin; the head says "vantage <store>"
  std::uint64_t version = 1;      ///< from 1; others are not read
  std::string_view extension;     ///< of a region's file, with the dot
  std::string_view shared = {};   ///< the name of a file that regions share; empty: there is none
  std::string_view scratch = {};  ///< the name of a file that only a build has; empty: none
  /// The size of a region's file; null if the counts do not determine it.
  std::uint64_t (*file_size)(const RegionFile&) = nullptr;
};

/// The region's label and the extension.
[[nodiscard]] inline std::string region_file_name(const BundleFormat& format,
                                                  const Region& region) {
  return region.label + std::string(format.extension);
}

/// Takes the next bytes of a file.
using Sink = std::function<Result<void>(std::string_view)>;

}  // namespace vantage::bundle_folder
