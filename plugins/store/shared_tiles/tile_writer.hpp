#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "common/partial_folder.hpp"
#include "point_ids.hpp"
#include "point_order.hpp"
#include "region_content.hpp"

namespace vantage::shared_tiles {

/// Puts points into tiles, writes these, and then says which points of which tiles a region has.
class TileWriter {
 public:
  /// Precondition: `fits` for every point.
  /// @param width  of a tile [m]
  TileWriter(const PointCloud& points, const PointOrder& order, double width);

  /// Whether a point is near enough to the map's origin to have a tile.
  [[nodiscard]] static bool fits(const Point& p, double width) noexcept;

  /// Errors: `io_failure`.
  [[nodiscard]] Result<void> write(bundle_folder::PartialFolder& folder, const std::string& name);

  /// The second part of a region's file. Precondition: the tiles are written.
  [[nodiscard]] std::string parts_of(RegionSequences::Cursor region);

 private:
  struct Tile {
    std::int64_t row = 0, column = 0;
    std::uint32_t points = 0;
    TilePlace place;
  };

  const PointCloud& points_;
  const PointOrder& order_;
  double width_;
  std::vector<Tile> tiles_;                        // by row and column
  std::vector<std::uint32_t> tile_;                // by rank
  std::vector<std::uint32_t> place_;               // in the tile, by rank
  std::vector<std::vector<std::uint32_t>> picks_;  // of the region at hand, by tile
};

}  // namespace vantage::shared_tiles
