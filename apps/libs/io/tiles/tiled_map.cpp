#include "vantage/io/tiled_map.hpp"

#include <fmt/format.h>
#include <tbb/blocked_range.h>
#include <tbb/parallel_for.h>
#include <tbb/parallel_reduce.h>

#include <algorithm>
#include <array>
#include <cstring>
#include <functional>
#include <limits>
#include <mutex>
#include <new>
#include <numeric>
#include <optional>
#include <span>
#include <string>
#include <utility>
#include <vector>

#include "io/tiles/index.hpp"
#include "io/tiles/words.hpp"
#include "vantage/kit/checksum.hpp"
#include "vantage/kit/file_content.hpp"

namespace vantage::io {

namespace fs = std::filesystem;
using tiles::Cell;
using tiles::Index;
using tiles::StoredTile;

struct TiledMap::Content {
  fs::path folder;
  Index index;
  std::vector<Tile> tiles;
  std::vector<std::uint64_t> first_cell;  // of each tile

  /// The rank of the first point of each cell of the index, in canonical order. Made at first use.
  [[nodiscard]] const std::vector<std::uint64_t>& ranks() const {
    std::call_once(ranked_, [this] {
      std::vector<std::uint32_t> order(index.cells.size());
      std::iota(order.begin(), order.end(), 0U);
      std::ranges::sort(order, [&](std::uint32_t a, std::uint32_t b) {
        return tiles::before(index.cells[a], index.cells[b]);
      });
      ranks_.resize(order.size());
      std::uint64_t rank = 0;
      for (const std::uint32_t cell : order) {
        ranks_[cell] = rank;
        rank += index.cells[cell].points;
      }
    });
    return ranks_;
  }

 private:
  mutable std::once_flag ranked_;
  mutable std::vector<std::uint64_t> ranks_;
};

namespace {

constexpr std::int64_t kMostCells = std::numeric_limits<std::int32_t>::max();

/// A cell of a rectangle that is read, and where its points go.
struct WantedCell {
  std::int32_t x = 0, y = 0;
  std::uint32_t tile = 0;
  std::uint64_t points = 0;
  std::uint64_t in_tile = 0;  // points of the tile before it
  std::uint64_t target = 0;   // points of the result before it
  std::uint64_t number = 0;   // in the index
};

template <class Stored>
std::uint64_t stored_bits(const char* bytes) noexcept {
  if constexpr (sizeof(Stored) == sizeof(float)) {
    std::uint32_t bits = 0;
    std::memcpy(&bits, bytes, sizeof(bits));
    return bits;
  } else {
    std::uint64_t bits = 0;
    std::memcpy(&bits, bytes, sizeof(bits));
    return bits;
  }
}

template <class Stored>
std::uint64_t checksum_of_tile(const char* bytes, std::uint64_t points) {
  constexpr std::uint64_t kGrain = 1 << 14U;
  return tbb::parallel_reduce(
      tbb::blocked_range<std::uint64_t>(0, points, kGrain), std::uint64_t{0},
      [&](const auto& range, std::uint64_t sum) {
        for (std::uint64_t i = range.begin(); i != range.end(); ++i) {
          const char* point = bytes + i * 3 * sizeof(Stored);
          sum += tiles::checksum_of_point(i, stored_bits<Stored>(point),
                                          stored_bits<Stored>(point + sizeof(Stored)),
                                          stored_bits<Stored>(point + 2 * sizeof(Stored)));
        }
        return sum;
      },
      std::plus<>{});
}

template <class Stored>
void unpack(const char* bytes, std::span<Point> into) noexcept {
  std::array<Stored, 3> xyz;
  for (Point& p : into) {
    std::memcpy(xyz.data(), bytes, sizeof(xyz));
    bytes += sizeof(xyz);
    p = Point(xyz[0], xyz[1], xyz[2]);
  }
}

/// The bytes of one tile at a time.
class TileBytes {
 public:
  TileBytes(const fs::path& folder, const Index& index) : folder_(folder), index_(index) {}

  /// Errors: `corrupt_data`, `io_failure`.
  [[nodiscard]] Result<const char*> read(const StoredTile& tile) {
    if (!pack_ || pack_number_ != tile.pack) {
      VANTAGE_TRY(InputFile pack,
                  InputFile::open(folder_ / tiles::pack_name(tile.pack), "a pack of a tiled map"));
      pack_.emplace(std::move(pack));
      pack_number_ = tile.pack;
    }
    const std::uint64_t size = tile.points * index_.point_size();
    if (size > capacity_) {
      bytes_.reset();
      bytes_ = std::make_unique_for_overwrite<char[]>(size);
      capacity_ = size;
    }
    VANTAGE_CHECK(pack_->read(tile.offset, {bytes_.get(), size}));
    const std::uint64_t sum = index_.coordinate_size == sizeof(float)
                                  ? checksum_of_tile<float>(bytes_.get(), tile.points)
                                  : checksum_of_tile<double>(bytes_.get(), tile.points);
    if (sum == tile.checksum) return bytes_.get();
    return fail(ErrorCode::corrupt_data,
                fmt::format("tile ({}, {}) is damaged: its {} bytes from byte {} on do not have "
                            "the checksum that the index states",
                            tile.index.x, tile.index.y, size, tile.offset),
                SourceLocation{pack_->name(), 0, 0});
  }

 private:
  const fs::path& folder_;
  const Index& index_;
  std::optional<InputFile> pack_;
  std::uint64_t pack_number_ = 0;
  std::unique_ptr<char[]> bytes_;
  std::uint64_t capacity_ = 0;
};

/// The cells of tiles that touch a rectangle, and lie in it, tile by tile.
std::vector<WantedCell> wanted_cells(const Index& index,
                                     const std::vector<std::uint64_t>& first_cell,
                                     const CellRectangle& cells) {
  std::vector<WantedCell> wanted;
  if (cells.empty()) return wanted;
  const auto side = static_cast<std::int64_t>(index.cells_a_side);
  const std::int64_t first_column = tiles::floor_quotient(cells.min_x, side);
  const std::int64_t last_column = tiles::floor_quotient(cells.max_x - 1, side);
  const std::int64_t last_row = tiles::floor_quotient(cells.max_y - 1, side);
  const auto from = [&](auto first, std::int64_t column, std::int64_t row) {
    return std::partition_point(first, index.tiles.end(), [&](const StoredTile& tile) {
      return tile.index.y < row || (tile.index.y == row && tile.index.x < column);
    });
  };
  auto tile = from(index.tiles.begin(), first_column, tiles::floor_quotient(cells.min_y, side));
  while (tile != index.tiles.end() && tile->index.y <= last_row) {
    if (tile->index.x < first_column) {
      tile = from(tile, first_column, tile->index.y);
      continue;
    }
    if (tile->index.x > last_column) {
      tile = from(tile, first_column, tile->index.y + std::int64_t{1});
      continue;
    }
    const auto number = static_cast<std::size_t>(tile - index.tiles.begin());
    std::uint64_t in_tile = 0;
    for (std::uint64_t k = 0; k < tile->cells; ++k) {
      const Cell& cell = index.cells[first_cell[number] + k];
      if (cell.x >= cells.min_x && cell.x < cells.max_x && cell.y >= cells.min_y &&
          cell.y < cells.max_y) {
        wanted.push_back({cell.x, cell.y, static_cast<std::uint32_t>(number), cell.points, in_tile,
                          0, first_cell[number] + k});
      }
      in_tile += cell.points;
    }
    ++tile;
  }
  return wanted;
}

}  // namespace

CellRectangle CellRectangle::covering(const Eigen::Vector2d& min,
                                      const Eigen::Vector2d& max) noexcept {
  const auto cell = [](double coordinate) {
    return std::int64_t{tiles::cell_at(
        std::clamp(coordinate, -tiles::kLargestCoordinate, tiles::kLargestCoordinate))};
  };
  return {cell(min.x()), cell(min.y()), cell(max.x()) + 1, cell(max.y()) + 1};
}

TiledMap::TiledMap(std::unique_ptr<const Content> content) noexcept
    : content_(std::move(content)) {}
TiledMap::TiledMap(TiledMap&&) noexcept = default;
TiledMap& TiledMap::operator=(TiledMap&&) noexcept = default;
TiledMap::~TiledMap() = default;

Result<TiledMap> TiledMap::open(const fs::path& folder) {
  if (!is_tiled_map(folder)) {
    return fail(ErrorCode::not_found,
                fmt::format("there is no tiled map here: no {}", tiles::kIndexFile),
                SourceLocation{folder.string(), 0, 0});
  }
  auto content = std::make_unique<Content>();
  content->folder = folder;
  VANTAGE_TRY(content->index, tiles::read_index(folder / tiles::kIndexFile));
  const Index& index = content->index;
  for (std::size_t pack = 0; pack < index.packs.size(); ++pack) {
    const fs::path file = folder / tiles::pack_name(pack);
    VANTAGE_TRY(const InputFile opened, InputFile::open(file, "a pack of a tiled map"));
    if (opened.size() == index.packs[pack]) continue;
    return fail(ErrorCode::corrupt_data,
                fmt::format("the pack has {} bytes, expected the {} that the index states",
                            opened.size(), index.packs[pack]),
                SourceLocation{file.string(), 0, 0});
  }
  std::uint64_t first = 0;
  std::uint64_t first_cell = 0;
  for (const StoredTile& tile : index.tiles) {
    content->tiles.push_back({tile.index, tile.points, first});
    content->first_cell.push_back(first_cell);
    first += tile.points;
    first_cell += tile.cells;
  }
  return TiledMap(std::move(content));
}

const fs::path& TiledMap::folder() const noexcept { return content_->folder; }
const Bounds3& TiledMap::bounds() const noexcept { return content_->index.bounds; }
std::uint64_t TiledMap::points() const noexcept { return content_->index.points; }
std::uint64_t TiledMap::dropped() const noexcept { return content_->index.dropped; }
double TiledMap::tile_size() const noexcept {
  return kCanonicalCell * static_cast<double>(content_->index.cells_a_side);
}
Precision TiledMap::precision() const noexcept {
  return content_->index.coordinate_size == sizeof(float) ? Precision::float32 : Precision::float64;
}
std::uint64_t TiledMap::checksum() const noexcept {
  Checksum sum;
  for (const StoredTile& tile : content_->index.tiles) {
    sum.add(tiles::packed(tile.index.x, tile.index.y));
    sum.add(tile.points);
    sum.add(tile.checksum);
  }
  return sum.value();
}
std::size_t TiledMap::packs() const noexcept { return content_->index.packs.size(); }
std::size_t TiledMap::cells() const noexcept { return content_->index.cells.size(); }
std::span<const TiledMap::Tile> TiledMap::tiles() const noexcept { return content_->tiles; }

CellRectangle TiledMap::cells_of(TileIndex tile) const noexcept {
  const auto side = static_cast<std::int64_t>(content_->index.cells_a_side);
  return {side * tile.x, side * tile.y, side * (tile.x + std::int64_t{1}),
          side * (tile.y + std::int64_t{1})};
}

std::uint64_t TiledMap::points_in(const CellRectangle& cells) const {
  std::uint64_t points = 0;
  for (const WantedCell& cell : wanted_cells(content_->index, content_->first_cell, cells)) {
    points += cell.points;
  }
  return points;
}

Result<PointCloud> TiledMap::read_cells(const CellRectangle& cells, PointOrder within) const {
  const Index& index = content_->index;
  std::vector<WantedCell> wanted = wanted_cells(index, content_->first_cell, cells);
  // Targets by rows of the whole rectangle; points are then read tile by tile.
  std::vector<std::uint32_t> order(wanted.size());
  for (std::size_t i = 0; i < order.size(); ++i) order[i] = static_cast<std::uint32_t>(i);
  std::sort(order.begin(), order.end(),
            [&](std::uint32_t a, std::uint32_t b) { return tiles::before(wanted[a], wanted[b]); });
  std::uint64_t points = 0;
  for (const std::uint32_t i : order) {
    wanted[i].target = points;
    points += wanted[i].points;
  }
  try {
    PointCloud cloud(points);
    TileBytes bytes(content_->folder, index);
    for (std::size_t begin = 0, end = 0; begin < wanted.size(); begin = end) {
      const StoredTile& tile = index.tiles[wanted[begin].tile];
      while (end < wanted.size() && wanted[end].tile == wanted[begin].tile) ++end;
      VANTAGE_TRY(const char* const of_tile, bytes.read(tile));
      tbb::parallel_for(begin, end, [&](std::size_t i) {
        const WantedCell& cell = wanted[i];
        const char* first = of_tile + cell.in_tile * index.point_size();
        const std::span points_of_cell(cloud.data() + cell.target, cell.points);
        if (index.coordinate_size == sizeof(float)) {
          unpack<float>(first, points_of_cell);
        } else {
          unpack<double>(first, points_of_cell);
        }
        if (within == PointOrder::canonical) sort_cell(points_of_cell);
      });
    }
    return cloud;
  } catch (const std::exception&) {  // bad_alloc, length_error
    return fail(ErrorCode::io_failure,
                fmt::format("not enough memory for {} points of this map", points),
                SourceLocation{content_->folder.string(), 0, 0});
  }
}

std::vector<MapPart::Run> TiledMap::runs_in(const CellRectangle& cells) const {
  const std::vector<std::uint64_t>& ranks = content_->ranks();
  std::vector<WantedCell> wanted = wanted_cells(content_->index, content_->first_cell, cells);
  std::ranges::sort(wanted, [](const auto& a, const auto& b) { return tiles::before(a, b); });
  std::vector<MapPart::Run> runs;
  std::uint64_t next_rank = 0;
  std::size_t begin = 0;
  for (const WantedCell& cell : wanted) {
    const std::uint64_t rank = ranks[cell.number];
    if (runs.empty() || rank != next_rank) runs.push_back({rank, begin});
    next_rank = rank + cell.points;
    begin += cell.points;
  }
  return runs;
}

Result<PointCloud> TiledMap::read(const CellRectangle& cells) const {
  return read_cells(cells, PointOrder::canonical);
}

Result<PointCloud> TiledMap::read(TileIndex tile) const { return read(cells_of(tile)); }

Result<PointCloud> TiledMap::read_as_stored(TileIndex tile) const {
  return read_cells(cells_of(tile), PointOrder::as_stored);
}

Result<PointCloud> TiledMap::read() const {
  return read(CellRectangle{-kMostCells - 1, -kMostCells - 1, kMostCells + 1, kMostCells + 1});
}

bool is_tiled_map(const fs::path& path) noexcept {
  std::error_code ignored;
  return fs::is_regular_file(path / tiles::kIndexFile, ignored);
}

}  // namespace vantage::io
