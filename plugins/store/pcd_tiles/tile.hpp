#pragma once

#include <cstdint>
#include <functional>
#include <string>
#include <string_view>

#include "vantage/point_cloud.hpp"
#include "vantage/result.hpp"

namespace vantage::pcd_tiles {

/// What the index keeps of one file.
struct TileInfo {
  std::uint64_t points = 0;
  Point origin = Point::Zero();  ///< map frame [m]; the file holds coordinates relative to it
  std::uint64_t bytes = 0;       ///< of the whole file
  std::uint64_t checksum = 0;    ///< FNV-1a, 64 bit, over the 32-bit words after the header
};

/// Takes the next bytes of a file.
using Sink = std::function<Result<void>(std::string_view)>;

/// Writes a binary PCD v0.7, x y z float32, little endian, in blocks: the file is never in memory
/// as a whole. Errors: `invalid_input`, before anything is written, for a coordinate that is not
/// finite, or too far from the others for float32; those of the sink.
[[nodiscard]] Result<TileInfo> encode(PointsView points, const Sink& sink);

/// Every byte is checked. Errors: `corrupt_data` for a content that is not what `info` says of it.
/// @param file  what error messages call it
[[nodiscard]] Result<PointCloud> decode(std::string_view content, const TileInfo& info,
                                        const std::string& file);

/// What `encode` would make for this many points.
[[nodiscard]] std::uint64_t file_size(std::uint64_t points, const Point& origin);

}  // namespace vantage::pcd_tiles
