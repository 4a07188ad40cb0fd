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

/// The points of tiles that a region takes.
class TakenPoints {
 public:
  /// @param tile  must outlive the object
  /// @param runs  of its points, ascending
  void add(const StoredTile& tile, std::vector<Run> runs);

  /// All points in the order that the code stands for, map frame [m]; nothing if it is no such
  /// code.
  [[nodiscard]] std::optional<PointCloud> in_order(std::string_view code);

 private:
  struct Part {
    const StoredTile* tile;
    std::vector<Run> runs;
    std::vector<std::uint32_t> begin;  // of each run, among the points that are taken; and the end
    std::size_t run = 0;               // where the last piece ended
    std::uint32_t next = 0;            // the point after it
  };
  [[nodiscard]] static Point* copy(Part& part, std::uint32_t begin, std::uint32_t end, Point* to);

  std::vector<Part> parts_;
  std::uint64_t count_ = 0;
};

}  // namespace vantage::shared_tiles
