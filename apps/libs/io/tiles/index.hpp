#pragma once

#include <cstdint>
#include <filesystem>
#include <string>
#include <vector>

#include "io/tiles/grid.hpp"
#include "vantage/kit/hash.hpp"

namespace vantage::io::tiles {

inline constexpr const char* kIndexFile = "index.vtiles";

/// "points_0003.pack".
[[nodiscard]] std::string pack_name(std::size_t pack);

/// A tile and where its points are.
struct StoredTile {
  TileIndex index;
  std::uint64_t pack = 0;
  std::uint64_t offset = 0;  // in its pack [bytes]
  std::uint64_t points = 0;
  std::uint64_t cells = 0;     // that hold a point
  std::uint64_t checksum = 0;  // see checksum_of_point
};

/// The content of the index file.
struct Index {
  std::uint64_t cells_a_side = 1;                 // of a tile
  std::uint64_t coordinate_size = sizeof(float);  // [bytes]: 4 or 8
  std::uint64_t points = 0;
  std::uint64_t dropped = 0;
  Bounds3 bounds;
  std::vector<std::uint64_t> packs;  // their sizes [bytes]
  std::vector<StoredTile> tiles;     // row by row
  std::vector<Cell> cells;           // tile by tile, row by row in each

  [[nodiscard]] std::uint64_t point_size() const noexcept { return 3 * coordinate_size; }
};

/// Sums of this over the points of a tile, modulo 2^64, are its checksum: the sum can be made in
/// any order.
/// @param place   of the point in its tile
/// @param x, y, z  the bits of the coordinates as they are stored
[[nodiscard]] constexpr std::uint64_t checksum_of_point(std::uint64_t place, std::uint64_t x,
                                                        std::uint64_t y, std::uint64_t z) noexcept {
  return scatter(scatter(place ^ scatter(x ^ (y << 32U | y >> 32U))) ^ z);
}

/// Puts packs and tiles around cells that are sorted as in an index: sizes and offsets, no
/// checksums. Tiles do not reach beyond a pack, and a pack of more than one tile has at most
/// `pack_size` bytes.
void lay_out(Index& index, std::uint64_t pack_size);

/// Errors: those of OutputFile.
[[nodiscard]] Result<void> write_index(const std::filesystem::path& file, const Index& index);
/// Errors (`where` is the file): those of InputFile::open; `unsupported` for a later version;
/// `corrupt_data` for a content that is damaged or contradicts itself.
[[nodiscard]] Result<Index> read_index(const std::filesystem::path& file);

}  // namespace vantage::io::tiles
