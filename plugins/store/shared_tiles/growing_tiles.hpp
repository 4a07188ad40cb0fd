#pragma once

#include <cstdint>
#include <string>
#include <string_view>
#include <unordered_map>
#include <vector>

#include "common/partial_folder.hpp"
#include "growing_tile.hpp"
#include "last_used.hpp"
#include "region_content.hpp"
#include "scratch.hpp"
#include "vantage/kit/hash.hpp"

namespace vantage::shared_tiles {

/// The tiles of a bundle that is being written. It holds as much of them as the limit allows, and
/// at least those of one region at a time; the rest is in the scratch file.
class GrowingTiles {
 public:
  /// @param width   of a tile [m]
  /// @param memory  for tiles [bytes]
  GrowingTiles(double width, std::uint64_t memory, Scratch& scratch);

  /// Whether a point is near enough to the map's origin to have a tile.
  [[nodiscard]] bool fits(const Point& p) const noexcept;

  /// Puts a region's points into tiles.
  /// Precondition: `fits` for every point, and `finish` was not called.
  /// @return  what `parts_of` needs to say which points of which tiles they are
  /// Errors: `invalid_input` for 2^32 - 1 points in a tile or more; `io_failure`.
  [[nodiscard]] Result<std::string> put(bundle_folder::PartialFolder& folder, PointsView points);

  /// Writes all tiles by row and column. Errors: `io_failure`.
  [[nodiscard]] Result<void> finish(bundle_folder::PartialFolder& folder, const std::string& name);

  /// The second part of a region's file. Precondition: the tiles are finished.
  /// @param put  what `put` has returned
  /// Errors: `io_failure`.
  [[nodiscard]] Result<std::string> parts_of(std::string_view put);

 private:
  struct Tile {
    Square square;
    std::uint32_t points = 0;
    Scratch::Place scratch = {};  // while growing the tile, then its history; no bytes: none
    TilePlace place = {};
  };
  /// A region's points of one tile.
  struct Share {
    std::uint32_t tile;
    PointCloud points = {};
    std::vector<std::uint32_t> order = {};  // by place in `points`, the number in canonical order;
                                            // empty: they are in that order
  };

  [[nodiscard]] Square square_of(const Point& p) const noexcept;
  [[nodiscard]] std::uint32_t number_of(const Square& square);
  [[nodiscard]] std::vector<Share> shares_of(PointsView points, std::vector<std::uint32_t>& owner);
  [[nodiscard]] Result<GrowingTile*> growing(std::uint32_t tile);
  [[nodiscard]] Result<void> make_room(bundle_folder::PartialFolder& folder);
  [[nodiscard]] Result<const TileHistory*> history(std::uint32_t tile);

  double width_, per_width_;
  Scratch& scratch_;
  std::vector<Tile> tiles_;
  std::unordered_map<Square, std::uint32_t, CellHash> numbers_;
  LastUsed<GrowingTile> growing_;  // by tile
  LastUsed<TileHistory> histories_;
  std::uint32_t puts_ = 0;
};

}  // namespace vantage::shared_tiles
