#pragma once

#include <cstdint>
#include <optional>
#include <span>
#include <vector>

#include "selection.hpp"
#include "stored_tile.hpp"
#include "vantage/point_cloud.hpp"

namespace vantage::shared_tiles {

/// Puts points of several tiles into the order of their ranks.
class MergedPoints {
 public:
  /// @param tile  must outlive the object
  /// @param runs  of its points, ascending
  void add(const StoredTile& tile, std::span<const Run> runs);

  /// All points that were added, map frame [m]; nothing if two of them have one rank.
  [[nodiscard]] std::optional<PointCloud> points();

 private:
  /// Points of a tile whose ranks follow each other.
  struct Piece {
    std::uint32_t rank;  // of the first
    std::uint32_t tile;
    std::uint32_t begin, end;
  };
  void sort();

  std::vector<const StoredTile*> tiles_;
  std::vector<Piece> pieces_;
  std::size_t count_ = 0;  // of the points
};

}  // namespace vantage::shared_tiles
