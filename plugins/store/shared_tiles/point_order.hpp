#pragma once

#include <cstdint>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "selection.hpp"
#include "stored_tile.hpp"
#include "vantage/point_cloud.hpp"

/// In which order a region has the points that it takes from its tiles.
namespace vantage::shared_tiles {

/// Points that a region takes from one tile, one after another: a piece of the order.
struct Piece {
  std::uint32_t part = 0;   ///< which of the region's tiles
  std::uint32_t begin = 0;  ///< among the points that are taken from the tile
  std::uint32_t count = 0;
};

/// Writes pieces down. A piece that begins where the one before it in its tile has ended takes two
/// numbers: a region in canonical order has no others, and few of them.
class OrderWriter {
 public:
  /// @param parts  number of tiles
  explicit OrderWriter(std::size_t parts) : next_(parts, 0) {}
  /// The next point of the region.
  void add(std::uint32_t part, std::uint32_t pick);
  /// The code, when all points were added.
  [[nodiscard]] std::string code() &&;

 private:
  void write();

  std::string code_;
  Piece piece_;
  std::vector<std::uint32_t> next_;  // by part
};

/// A piece, and where it stands among the points of the region.
struct PlacedPiece {
  std::size_t to = 0;
  std::uint32_t begin = 0, count = 0;
};

/// The pieces of each tile, one after another; nothing if it is no such code.
/// @param counts  of the points that are taken from each tile
[[nodiscard]] std::optional<std::vector<std::vector<PlacedPiece>>> read_order(
    std::string_view code, std::span<const std::uint32_t> counts);

/// Copies the pieces of one tile to their places.
/// @param runs    of the tile's points: those that the region takes, ascending
/// @param points  of the region, map frame [m]
void place_points(const StoredTile& tile, std::span<const Run> runs,
                  std::span<const PlacedPiece> pieces, PointCloud& points);

}  // namespace vantage::shared_tiles
