#pragma once

#include <array>
#include <cstdint>
#include <memory>
#include <string>

#include "vantage/point_cloud.hpp"

namespace vantage::shared_tiles {

/// A point in the file of tiles: x, y, z relative to the tile's origin [m].
using TileCoordinates = std::array<float, 3>;
static_assert(sizeof(TileCoordinates) == 12);

/// Where a tile lies in the file of tiles, and what a reader must find there.
struct TilePlace {
  std::uint64_t offset = 0;    ///< in the file [bytes]
  std::uint64_t bytes = 0;     ///< whole words
  std::uint64_t checksum = 0;  ///< XXH64 of its bytes
};

/// The points of a square of the map.
struct StoredTile {
  std::unique_ptr<char[]> bytes;  ///< of the file
  std::uint64_t size = 0;         ///< [bytes]
  std::uint32_t points = 0;
  Point origin = Point::Zero();  ///< map frame [m]

  /// Writes points begin to end - 1 to `to`, map frame [m]; returns where the next one goes.
  Point* copy(std::uint32_t begin, std::uint32_t end, Point* to) const noexcept;
  [[nodiscard]] std::uint64_t memory() const noexcept { return sizeof *this + size; }
};

/// @param corner  of the square with the least coordinates, map frame [m]
/// @param width   of the square [m]
[[nodiscard]] std::string encode_tile(PointsView points, const Eigen::Vector2d& corner,
                                      double width);

/// Takes the bytes of a tile; returns false, and leaves it unusable, if they are not those of a
/// tile.
[[nodiscard]] bool decode_tile(StoredTile& tile);

}  // namespace vantage::shared_tiles
