#pragma once

#include <cstdint>
#include <functional>
#include <string>
#include <string_view>

#include "vantage/map_store.hpp"
#include "vantage/point_cloud.hpp"
#include "vantage/result.hpp"

namespace vantage::pcd_tiles {

/// What the index says about one file.
struct TileInfo {
  std::uint64_t points = 0;
  std::uint64_t viewpoints = 0;
  std::uint64_t elements = 0;        ///< of the prepared map
  std::uint64_t prepared_bytes = 0;  ///< of the prepared map, without the padding
  Point origin = Point::Zero();      ///< map frame [m]; the file holds coordinates relative to it
  std::uint64_t bytes = 0;           ///< of the whole file
  std::uint64_t checksum = 0;        ///< FNV-1a, 64 bit, over the 32-bit words after the header
  std::uint32_t max_views = 0;       ///< 0: the points have no view counts

  [[nodiscard]] RegionSummary summary() const noexcept {
    return {.points = points,
            .viewpoints = viewpoints,
            .elements = elements,
            .bytes = bytes,
            .max_views = max_views};
  }
};

inline constexpr std::uint64_t kMaxPoints = std::uint64_t{1} << 40U;         ///< the limit for
                                                                             ///< viewpoints, too
inline constexpr std::uint64_t kMaxPreparedBytes = std::uint64_t{1} << 50U;  ///< of a region

/// Takes the next bytes of a file.
using Sink = std::function<Result<void>(std::string_view)>;

/// Writes a binary PCD v0.7 of the points, x y z float32, then views uint32 if the map has view
/// counts, little endian. Behind the PCD data come the viewpoints, x y z, and the prepared bytes,
/// filled up with zeros to whole words. Works in blocks: the whole file is never in memory.
/// Errors: `invalid_input`, before anything is written, for a coordinate that is not finite or too
/// far from the others for float32, for view counts that are 0 or not one per point, and for
/// elements without bytes; those of the sink.
[[nodiscard]] Result<TileInfo> encode(const RegionMap& map, const Sink& sink);

/// Checks every byte. Errors: `corrupt_data` for content that does not agree with `info`.
/// @param file  the file's name in error messages
[[nodiscard]] Result<RegionMap> decode(std::string_view content, const TileInfo& info,
                                       const std::string& file);

/// The size of the file that `encode` would make for a map with these counts and this origin.
/// Precondition: the counts are not above the limits.
[[nodiscard]] std::uint64_t file_size(const TileInfo& info);

}  // namespace vantage::pcd_tiles
