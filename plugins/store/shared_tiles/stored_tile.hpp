#pragma once

#include <cstdint>
#include <memory>
#include <span>
#include <string>
#include <vector>

#include "vantage/point_cloud.hpp"

namespace vantage::shared_tiles {

/// Where a tile lies in the file of tiles, and what a reader must find there.
struct TilePlace {
  std::uint64_t offset = 0;    ///< in the file [bytes]
  std::uint64_t bytes = 0;     ///< whole words
  std::uint64_t checksum = 0;  ///< FNV-1a, 64 bit, over words of 64 bits
};

/// The points of a square of the map, in the order of their ranks.
struct StoredTile {
  std::unique_ptr<char[]> bytes;     ///< of the file
  std::uint64_t size = 0;            ///< [bytes]
  Point origin = Point::Zero();      ///< map frame [m]
  std::vector<std::uint32_t> ranks;  ///< of the points, strictly ascending

  [[nodiscard]] std::uint32_t points() const noexcept {
    return static_cast<std::uint32_t>(ranks.size());
  }
  /// Map frame [m].
  [[nodiscard]] Point point(std::uint32_t i) const noexcept;
  [[nodiscard]] std::uint64_t memory() const noexcept {
    return sizeof *this + size + ranks.size() * sizeof(std::uint32_t);
  }
};

/// @param corner  of the square with the least coordinates, map frame [m]
/// @param width   of the square [m]
/// @param points  of the tile, by rank
[[nodiscard]] std::string encode_tile(PointsView points, std::span<const std::uint32_t> ranks,
                                      const Eigen::Vector2d& corner, double width);

/// Takes the bytes of a tile; returns false, and leaves it unusable, if they are not those of a
/// tile.
[[nodiscard]] bool decode_tile(StoredTile& tile);

}  // namespace vantage::shared_tiles
