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

/// Points of a tile whose ranks follow each other; it ends where the next one begins.
struct Stretch {
  std::uint32_t begin = 0;  ///< the first of the points
  std::uint32_t rank = 0;   ///< of this point
};

/// The points of a square of the map, in the order of their ranks.
struct StoredTile {
  std::unique_ptr<char[]> bytes;  ///< of the file
  std::uint64_t size = 0;         ///< [bytes]
  std::uint32_t points = 0;
  Point origin = Point::Zero();  ///< map frame [m]
  std::vector<Stretch> stretches;

  /// Writes points begin to end - 1 to `to`, map frame [m]; returns where the next one goes.
  Point* copy(std::uint32_t begin, std::uint32_t end, Point* to) const noexcept;
  [[nodiscard]] std::uint64_t memory() const noexcept {
    return sizeof *this + size + stretches.size() * sizeof(Stretch);
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
