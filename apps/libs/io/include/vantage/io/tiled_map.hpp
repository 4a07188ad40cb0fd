#pragma once

#include <cstdint>
#include <filesystem>
#include <memory>
#include <span>
#include <vector>

#include "vantage/io/point_cloud_io.hpp"
#include "vantage/kit/canonical_order.hpp"
#include "vantage/kit/map_parts.hpp"
#include "vantage/point_cloud.hpp"
#include "vantage/result.hpp"

namespace vantage::io {

/// Tiles consist of whole cells, so that tiles of any size give the same order of points.
using vantage::kCanonicalCell;

/// Cells from (min_x, min_y) on, to before (max_x, max_y).
struct CellRectangle {
  std::int64_t min_x = 0, min_y = 0, max_x = 0, max_y = 0;

  /// The cells that overlap a rectangle of the map's frame [m], its upper ends included. Where it
  /// reaches beyond all cells that a map may have, it is cut.
  [[nodiscard]] static CellRectangle covering(const Eigen::Vector2d& min,
                                              const Eigen::Vector2d& max) noexcept;
  [[nodiscard]] bool empty() const noexcept { return min_x >= max_x || min_y >= max_y; }
  friend bool operator==(const CellRectangle&, const CellRectangle&) = default;
};

/// Tile (x, y) of size s is the square [s x, s x + s) x [s y, s y + s) of the map's frame.
struct TileIndex {
  std::int32_t x = 0, y = 0;
  friend bool operator==(const TileIndex&, const TileIndex&) = default;
};

/// A map that `vantage tile` has sorted into tiles: a folder of pack files and an index.
/// docs/files.md describes its bytes.
///
/// What is read is in canonical order (vantage/kit/canonical_order.hpp): the points of a rectangle
/// are the same sequence, whatever the size of the tiles and the order of the input. Only
/// `read_as_stored` and the passes of TiledParts leave a cell's points as they are. The points of
/// each tile that is touched are compared with its checksum.
/// Thread safety: const methods may run on one object from many threads at once.
class TiledMap {
 public:
  struct Tile {
    TileIndex index;
    std::uint64_t points = 0;
    std::uint64_t first = 0;  ///< the points of all tiles before it
  };

  /// Reads the index, and compares the sizes of the packs with it.
  /// Errors (`where` is the file): `not_found` for a folder without an index; `unsupported` for an
  /// index of a later version; `corrupt_data`; `io_failure`.
  [[nodiscard]] static Result<TiledMap> open(const std::filesystem::path& folder);

  TiledMap(TiledMap&&) noexcept;
  TiledMap& operator=(TiledMap&&) noexcept;
  ~TiledMap();

  [[nodiscard]] const std::filesystem::path& folder() const noexcept;
  [[nodiscard]] const Bounds3& bounds() const noexcept;
  [[nodiscard]] std::uint64_t points() const noexcept;
  /// Points of the input with a NaN or infinite coordinate, which were left out.
  [[nodiscard]] std::uint64_t dropped() const noexcept;
  [[nodiscard]] double tile_size() const noexcept;  ///< [m]
  [[nodiscard]] Precision precision() const noexcept;
  /// Of all points and their tiles, from the index.
  [[nodiscard]] std::uint64_t checksum() const noexcept;
  [[nodiscard]] std::size_t packs() const noexcept;
  [[nodiscard]] std::size_t cells() const noexcept;  ///< that hold a point
  /// The tiles that hold a point, row by row ((y, x) ascending).
  [[nodiscard]] std::span<const Tile> tiles() const noexcept;
  [[nodiscard]] CellRectangle cells_of(TileIndex tile) const noexcept;

  /// How many points a rectangle of cells holds.
  [[nodiscard]] std::uint64_t points_in(const CellRectangle& cells) const;
  /// The points of a rectangle of cells, in canonical order. Needs memory for these points and for
  /// the bytes of one tile.
  /// Errors: `corrupt_data` for a tile that does not have its checksum (`where` is the pack, the
  /// message names the tile), `io_failure`.
  [[nodiscard]] Result<PointCloud> read(const CellRectangle& cells) const;
  /// Where the points of `read` are among all points of the map, in canonical order.
  [[nodiscard]] std::vector<MapPart::Run> runs_in(const CellRectangle& cells) const;
  /// The points of a tile; none if the map has no such tile. Errors: those above.
  [[nodiscard]] Result<PointCloud> read(TileIndex tile) const;
  /// The same in the order of the pack, in less time.
  [[nodiscard]] Result<PointCloud> read_as_stored(TileIndex tile) const;
  /// All points. Errors: those above.
  [[nodiscard]] Result<PointCloud> read() const;

 private:
  struct Content;
  enum class PointOrder : std::uint8_t { canonical, as_stored };  // of a cell's points
  [[nodiscard]] Result<PointCloud> read_cells(const CellRectangle& cells, PointOrder within) const;
  explicit TiledMap(std::unique_ptr<const Content> content) noexcept;

  std::unique_ptr<const Content> content_;
};

/// A tiled map, as builds read it part by part: what is read is in canonical order.
class TiledParts final : public MapParts {
 public:
  /// @param map  borrowed
  explicit TiledParts(const TiledMap& map) noexcept : map_(map) {}

  [[nodiscard]] Bounds3 bounds() const noexcept override { return map_.bounds(); }
  [[nodiscard]] std::uint64_t points() const noexcept override { return map_.points(); }
  /// Tile by tile, in the order of the packs.
  [[nodiscard]] Result<void> pass(MapVisitor& visitor) const noexcept override;
  [[nodiscard]] Result<void> pass_over(const Bounds2& area,
                                       MapVisitor& visitor) const noexcept override;
  [[nodiscard]] std::uint64_t points_in(const Bounds2& area) const override;
  [[nodiscard]] Result<MapPart> read(const Bounds2& area) const override;

 private:
  const TiledMap& map_;
};

/// Puts points in canonical order. A build in memory then gives the bundle that a build of the same
/// points in tiles gives.
void into_canonical_order(PointCloud& points);

/// Whether a path is a folder with the index of a tiled map.
[[nodiscard]] bool is_tiled_map(const std::filesystem::path& path) noexcept;

}  // namespace vantage::io
