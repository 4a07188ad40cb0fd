#include "io/tiles/index.hpp"

#include <fmt/format.h>

#include <limits>

#include "io/tiles/words.hpp"

namespace vantage::io::tiles {
namespace {

constexpr std::uint64_t kIndexMagic = 0x53454c4954475456ULL;  // "VTGTILES"
constexpr std::uint64_t kIndexVersion = 2;
constexpr std::uint64_t kHeadWords = 17;
constexpr std::uint64_t kTileWords = 6;
constexpr std::uint64_t kCellWords = 2;

/// Reads an index, whose every number may be forged.
class IndexReader {
 public:
  explicit IndexReader(WordReader64 words) noexcept : words_(std::move(words)) {}

  [[nodiscard]] Result<Index> read() {
    VANTAGE_CHECK(read_head());
    for (std::uint64_t& pack : index_.packs) {
      VANTAGE_TRY(pack, words_.get());
    }
    for (StoredTile& tile : index_.tiles) VANTAGE_CHECK(read_tile(tile));
    for (Cell& cell : index_.cells) {
      VANTAGE_TRY(const std::uint64_t place, words_.get());
      VANTAGE_TRY(cell.points, words_.get());
      cell.x = low(place);
      cell.y = high(place);
    }
    VANTAGE_CHECK(words_.finish());
    VANTAGE_CHECK(check());
    return std::move(index_);
  }

 private:
  [[nodiscard]] Result<void> read_head() {
    VANTAGE_TRY(const std::uint64_t magic, words_.get());
    if (magic != kIndexMagic) {
      return words_.error("the file does not begin with VTGTILES: no index of a tiled map");
    }
    VANTAGE_TRY(const std::uint64_t version, words_.get());
    if (version != kIndexVersion) {
      auto error =
          words_.error(fmt::format("version {} of the index, expected {}", version, kIndexVersion));
      error.value().code = ErrorCode::unsupported;
      return error;
    }
    VANTAGE_TRY(const std::uint64_t cell, words_.get());
    if (std::bit_cast<double>(cell) != kCanonicalCell) {
      return words_.error(
          fmt::format("cells of {} m, expected {} m", std::bit_cast<double>(cell), kCanonicalCell));
    }
    for (std::uint64_t* word :
         {&index_.cells_a_side, &index_.coordinate_size, &index_.points, &index_.dropped}) {
      VANTAGE_TRY(*word, words_.get());
    }
    for (Point* corner : {&index_.bounds.min, &index_.bounds.max}) {
      for (double& coordinate : *corner) {
        VANTAGE_TRY(const std::uint64_t word, words_.get());
        coordinate = std::bit_cast<double>(word);
      }
    }
    std::uint64_t packs = 0;
    std::uint64_t tiles = 0;
    std::uint64_t cells = 0;
    for (std::uint64_t* count : {&packs, &tiles, &cells}) {
      VANTAGE_TRY(*count, words_.get());
      if (*count > words_.size()) return wrong_size();
    }
    if (words_.size() != kHeadWords + packs + kTileWords * tiles + kCellWords * cells) {
      return wrong_size();
    }
    index_.packs.resize(packs);
    index_.tiles.resize(tiles);
    index_.cells.resize(cells);
    return {};
  }

  [[nodiscard]] tl::unexpected<Error> wrong_size() const {
    return words_.error(
        fmt::format("the file has {} bytes, which are not those of its packs, "
                    "tiles and cells: it is cut off or damaged",
                    8 * words_.size()));
  }

  [[nodiscard]] Result<void> read_tile(StoredTile& tile) {
    VANTAGE_TRY(const std::uint64_t place, words_.get());
    tile.index = {low(place), high(place)};
    for (std::uint64_t* word :
         {&tile.pack, &tile.offset, &tile.points, &tile.cells, &tile.checksum}) {
      VANTAGE_TRY(*word, words_.get());
    }
    return {};
  }

  /// Sizes and offsets follow from the cells, so they must be those that `lay_out` gives.
  [[nodiscard]] Result<void> check() const {
    constexpr std::uint64_t kMost = std::numeric_limits<std::int64_t>::max();
    constexpr std::uint64_t kLargestSide = std::numeric_limits<std::int32_t>::max();
    const auto wrong = [&](std::string_view what) {
      return words_.error(fmt::format("the index contradicts itself: {}", what));
    };
    if (index_.coordinate_size != sizeof(float) && index_.coordinate_size != sizeof(double)) {
      return wrong(fmt::format("coordinates of {} bytes", index_.coordinate_size));
    }
    if (index_.cells_a_side == 0 || index_.cells_a_side > kLargestSide) {
      return wrong(fmt::format("tiles of {} cells a side", index_.cells_a_side));
    }
    if (index_.points > kMost / index_.point_size()) return wrong("too many points");
    std::uint64_t points = 0;
    std::size_t cell = 0;
    const auto side = static_cast<std::int64_t>(index_.cells_a_side);
    // Tiles follow each other without a gap: no byte of a pack is a point of two of them.
    std::uint64_t pack = 0, end = 0;  // where the next tile begins
    for (std::size_t t = 0; t < index_.tiles.size(); ++t) {
      const StoredTile& tile = index_.tiles[t];
      if (t > 0 && !before(index_.tiles[t - 1].index, tile.index)) return wrong("order of tiles");
      if (tile.cells > index_.cells.size() - cell || tile.cells == 0)
        return wrong("cells of tiles");
      std::uint64_t in_tile = 0;
      for (std::uint64_t k = 0; k < tile.cells; ++k, ++cell) {
        const Cell& c = index_.cells[cell];
        if (k > 0 && !before(index_.cells[cell - 1], c)) return wrong("order of cells");
        if (tile_of(c.x, c.y, side) != tile.index) return wrong("a cell outside its tile");
        if (c.points == 0 || c.points > index_.points - points) return wrong("points of cells");
        points += c.points;
        in_tile += c.points;
      }
      if (in_tile != tile.points) return wrong("points of tiles");
      if (tile.pack >= index_.packs.size()) return wrong("packs of tiles");
      if (tile.pack == pack + 1 && end == index_.packs[pack]) ++pack, end = 0;
      if (tile.pack != pack || tile.offset != end)
        return wrong("tiles that do not follow each other");
      const std::uint64_t bytes = in_tile * index_.point_size();
      if (bytes > index_.packs[pack] - end) return wrong("a tile outside its pack");
      end += bytes;
    }
    if (cell != index_.cells.size() || points != index_.points) return wrong("number of points");
    const bool is_full = index_.packs.empty()
                             ? index_.tiles.empty()
                             : pack + 1 == index_.packs.size() && end == index_.packs[pack];
    if (!is_full) return wrong("a pack with more than its tiles");
    return {};
  }

  WordReader64 words_;
  Index index_;
};

}  // namespace

std::string pack_name(std::size_t pack) { return fmt::format("points_{:04}.pack", pack); }

void lay_out(Index& index, std::uint64_t pack_size) {
  index.packs.clear();
  index.tiles.clear();
  index.points = 0;
  for (const Cell& cell : index.cells) {
    const TileIndex place = tile_of(cell.x, cell.y, static_cast<std::int64_t>(index.cells_a_side));
    if (index.tiles.empty() || index.tiles.back().index != place) {
      index.tiles.push_back({.index = place});
    }
    index.tiles.back().points += cell.points;
    ++index.tiles.back().cells;
    index.points += cell.points;
  }
  for (StoredTile& tile : index.tiles) {
    const std::uint64_t bytes = tile.points * index.point_size();
    if (index.packs.empty() || (index.packs.back() > 0 && index.packs.back() + bytes > pack_size)) {
      index.packs.push_back(0);
    }
    tile.pack = index.packs.size() - 1;
    tile.offset = index.packs.back();
    index.packs.back() += bytes;
  }
}

Result<void> write_index(const std::filesystem::path& file, const Index& index) {
  VANTAGE_TRY(WordWriter words, WordWriter::create(file));
  words.put(kIndexMagic);
  words.put(kIndexVersion);
  words.put(kCanonicalCell);
  for (const std::uint64_t word :
       {index.cells_a_side, index.coordinate_size, index.points, index.dropped}) {
    words.put(word);
  }
  for (const Point& corner : {index.bounds.min, index.bounds.max}) {
    for (const double coordinate : corner) words.put(coordinate);
  }
  for (const std::size_t count : {index.packs.size(), index.tiles.size(), index.cells.size()}) {
    words.put(std::uint64_t{count});
  }
  for (const std::uint64_t pack : index.packs) words.put(pack);
  for (const StoredTile& tile : index.tiles) {
    words.put(packed(tile.index.x, tile.index.y));
    for (const std::uint64_t word :
         {tile.pack, tile.offset, tile.points, tile.cells, tile.checksum}) {
      words.put(word);
    }
  }
  for (const Cell& cell : index.cells) {
    words.put(packed(cell.x, cell.y));
    words.put(cell.points);
  }
  return words.commit();
}

Result<Index> read_index(const std::filesystem::path& file) {
  VANTAGE_TRY(WordReader64 words, WordReader64::open(file, "the index of a tiled map"));
  return IndexReader(std::move(words)).read();
}

}  // namespace vantage::io::tiles
