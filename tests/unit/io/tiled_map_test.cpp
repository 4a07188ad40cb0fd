#include "vantage/io/tiled_map.hpp"

#include <array>

#include "io/tiles/grid.hpp"
#include "io/tiles/index.hpp"
#include "tiles.hpp"
#include "vantage/kit/checksum.hpp"

namespace vantage {
namespace {

namespace fs = std::filesystem;
using namespace test;

/// A map of two files, tiled.
class TiledWorld {
 public:
  explicit TiledWorld(double tile_size = 25.0) {
    points = scattered(20000, 1);
    const auto half = points.begin() + 9000;
    write("a.pcd", PointCloud(points.begin(), half));
    write("b.pcd", PointCloud(half, points.end()));
    tile("map", tile_size);
  }
  void write(const std::string& name, const PointCloud& cloud) const {
    REQUIRE(io::write_pcd(path(name), cloud, io::Precision::float32));
  }
  void tile(const std::string& name, double tile_size) const {
    io::TilingOptions options = little(path(name));
    options.tile_size = tile_size;
    tiled({path("a.pcd"), path("b.pcd")}, options);
  }
  [[nodiscard]] fs::path path(const std::string& name) const { return folder_.path() / name; }

  PointCloud points;

 private:
  TemporaryFolder folder_;
};

TEST_CASE("tiled map: what it says about itself") {
  const TiledWorld world;
  const io::TiledMap map = opened(world.path("map"));
  CHECK(map.points() == world.points.size());
  CHECK(map.tile_size() == 25.0);
  CHECK(map.precision() == io::Precision::float32);
  CHECK(map.dropped() == 0);
  const Bounds3 bounds = bounds_of(world.points);
  CHECK(map.bounds().min == bounds.min);
  CHECK(map.bounds().max == bounds.max);
  CHECK(map.packs() > 10);
  CHECK(map.tiles().front().index == io::TileIndex{-2, -2});
  CHECK(map.tiles().back().index == io::TileIndex{1, 1});
  CHECK(map.tiles().size() == 16);
  CHECK(map.cells() > 16 * 16);  // -40 to 40, both included: what lies on the edge is beyond
  std::uint64_t points = 0;
  for (const io::TiledMap::Tile& tile : map.tiles()) {
    CHECK(tile.first == points);
    points += tile.points;
  }
  CHECK(points == map.points());
}

TEST_CASE("tiled map: any rectangle of cells, from tiles of any size, is in canonical order") {
  const TiledWorld world(5.0);
  world.tile("tiles_10", 10.0);
  world.tile("tiles_35", 35.0);
  world.tile("tiles_1000", 1000.0);
  const PointCloud all = in_canonical_order(world.points);
  for (const std::string name : {"map", "tiles_10", "tiles_35", "tiles_1000"}) {
    CAPTURE(name);
    const io::TiledMap map = opened(world.path(name));
    CHECK(map.read().value() == all);
    CHECK(io::read_point_cloud(world.path(name)).value().points == all);
    for (const io::CellRectangle& cells :
         {io::CellRectangle{-3, -2, 4, 1}, io::CellRectangle{0, 0, 1, 1},
          io::CellRectangle{-100, -7, 100, -6}, io::CellRectangle{2, 2, 2, 9},
          io::CellRectangle{50, 50, 60, 60}}) {
      CHECK(map.read(cells).value() == within(all, cells));
      CHECK(map.points_in(cells) == within(all, cells).size());
    }
    for (const io::TiledMap::Tile& tile : map.tiles()) {
      const auto points = map.read(tile.index).value();
      CHECK(points.size() == tile.points);
      CHECK(points == within(all, map.cells_of(tile.index)));
    }
    CHECK(map.read(io::TileIndex{1000, -1000}).value().empty());
  }
}

TEST_CASE("tiled map: cells are world-anchored and half open, also next to a border") {
  for (const int border : {0, 5, -5, 15, -35, 500'000, 4'000'005}) {
    CAPTURE(border);
    const double at = border;
    CHECK(io::tiles::cell_at(at) == border / 5);
    CHECK(io::tiles::cell_at(std::nextafter(at, 1e9)) == border / 5);
    CHECK(io::tiles::cell_at(std::nextafter(at, -1e9)) == border / 5 - 1);
  }
  CHECK(io::tiles::tile_of(-1, 4, 5) == io::TileIndex{-1, 0});
  CHECK(io::tiles::tile_of(-5, 5, 5) == io::TileIndex{-1, 1});
  CHECK(io::tiles::tile_of(-6, -1, 5) == io::TileIndex{-2, -1});
  CHECK(io::CellRectangle::covering({-0.1, 0.0}, {4.9, 10.0}) == io::CellRectangle{-1, 0, 1, 3});
  CHECK_FALSE(io::CellRectangle::covering({-1e30, -1e30}, {1e30, 1e30}).empty());
}

TEST_CASE("tiled map: a damaged byte is an error that names the file and the tile") {
  const TiledWorld world;
  const fs::path pack = world.path("map") / "points_0003.pack";
  std::string bytes = content_of(pack);
  bytes[bytes.size() / 2] = static_cast<char>(bytes[bytes.size() / 2] ^ 4);
  put(pack, bytes);
  const io::TiledMap map = opened(world.path("map"));
  const auto all = map.read();
  REQUIRE_FALSE(all);
  check_clear(all.error(), ErrorCode::corrupt_data, "points_0003.pack", "tile (");
  int damaged = 0;
  for (const io::TiledMap::Tile& tile : map.tiles()) damaged += map.read(tile.index) ? 0 : 1;
  CHECK(damaged == 1);

  put(pack, bytes.substr(1));
  const auto cut = io::TiledMap::open(world.path("map"));
  REQUIRE_FALSE(cut);
  check_clear(cut.error(), ErrorCode::corrupt_data, "points_0003.pack", "bytes, expected");
  fs::remove(pack);
  CHECK(io::TiledMap::open(world.path("map")).error().code == ErrorCode::not_found);
}

TEST_CASE("tiled map: a damaged index is refused, whatever is wrong with it") {
  const TiledWorld world;
  const fs::path file = world.path("map") / "index.vtiles";
  const std::string good = content_of(file);
  const auto refused = [&](const std::string& bytes, ErrorCode code, const std::string& expected) {
    put(file, bytes);
    const auto map = io::TiledMap::open(world.path("map"));
    REQUIRE_FALSE(map);
    check_clear(map.error(), code, "index.vtiles", expected);
  };
  refused(good.substr(0, good.size() - 8), ErrorCode::corrupt_data, "cut off or damaged");
  refused(good.substr(0, good.size() - 3), ErrorCode::corrupt_data, "words of 8");
  refused(good.substr(0, 16), ErrorCode::corrupt_data, "ends at byte 16");
  refused("", ErrorCode::corrupt_data, "empty");
  refused("PK" + good.substr(2), ErrorCode::corrupt_data, "VTGTILES");
  std::string later = good;
  later[8] = 3;
  refused(later, ErrorCode::unsupported, "version 3");
  for (std::size_t at = 24; at < good.size(); at += at < 400 ? 1 : 97) {
    CAPTURE(at);
    std::string bytes = good;
    bytes[at] = static_cast<char>(bytes[at] ^ 0x10);
    put(file, bytes);
    CHECK_FALSE(io::TiledMap::open(world.path("map")));
  }
  fs::remove(file);
  CHECK(io::TiledMap::open(world.path("map")).error().code == ErrorCode::not_found);
  CHECK(io::TiledMap::open(world.path("none")).error().code == ErrorCode::not_found);
}

TEST_CASE("tiled map: a forged index with a sound checksum is an error or a map, never a crash") {
  const TiledWorld world;
  const fs::path file = world.path("map") / "index.vtiles";
  const std::string good = content_of(file);
  std::mt19937_64 random(7);
  int refused = 0;
  int changed = 0;
  for (std::size_t at = 16; at + 8 < good.size(); at += at < 1600 ? 8 : 8 * 13) {
    for (const std::uint64_t word : {std::uint64_t{0}, std::uint64_t{1}, ~std::uint64_t{0},
                                     std::uint64_t{1} << 62U, random()}) {
      CAPTURE(at);
      CAPTURE(word);
      std::string bytes = good;
      bytes.replace(at, 8, raw(word));
      if (bytes == good) continue;
      const std::string_view body = std::string_view(bytes).substr(0, bytes.size() - 8);
      bytes.replace(bytes.size() - 8, 8, raw(checksum_of(body)));
      put(file, bytes);
      ++changed;
      const auto map = io::TiledMap::open(world.path("map"));
      if (!map || !map->read()) ++refused;
    }
  }
  CHECK(refused > changed * 9 / 10);  // the rest are bounds and the number of points left out
  CHECK(refused < changed);
}

TEST_CASE(
    "tiled map: tiles that share bytes of a pack are refused: they would multiply its points") {
  const TemporaryFolder folder;
  const PointCloud points{{1.0, 2.0, 3.0}, {101.0, 2.0, 3.0}, {201.0, 2.0, 3.0}};
  REQUIRE(io::write_pcd(folder.path() / "a.pcd", points, io::Precision::float64));
  tiled({folder.path() / "a.pcd"}, {.out = folder.path() / "map"});
  const fs::path file = folder.path() / "map" / "index.vtiles";
  std::string index = content_of(file);
  constexpr std::size_t kFirstTile = 16 + 1;  // a head and the size of a pack
  const auto word = [&](std::size_t tile, std::size_t k) {
    return index.begin() + static_cast<std::ptrdiff_t>(8 * (kFirstTile + 6 * tile + k));
  };
  for (const std::size_t tile : {1U, 2U}) {
    for (const std::size_t k : {2U, 5U}) std::copy_n(word(0, k), 8, word(tile, k));
  }
  const std::string_view body = std::string_view(index).substr(0, index.size() - 8);
  index.replace(index.size() - 8, 8, raw(checksum_of(body)));
  put(file, index);
  const auto map = io::TiledMap::open(folder.path() / "map");
  REQUIRE_FALSE(map);
  check_clear(map.error(), ErrorCode::corrupt_data, "index.vtiles",
              "tiles that do not follow each other");
}

TEST_CASE("tiled map: an index is what docs/files.md describes") {
  const TemporaryFolder folder;
  const PointCloud points{{1.0, -2.0, 3.0}, {26.0, 7.0, 0.5}, {2.0, -1.0, 4.0}};
  REQUIRE(io::write_pcd(folder.path() / "a.pcd", points, io::Precision::float64));
  tiled({folder.path() / "a.pcd"}, {.out = folder.path() / "map"});
  const std::string index = content_of(folder.path() / "map" / "index.vtiles");
  REQUIRE(index.size() == 8 * (16 + 1 + 2 * 6 + 2 * 2 + 1));
  const auto word = [&](std::size_t at) {
    std::uint64_t value = 0;
    std::memcpy(&value, index.data() + 8 * at, 8);
    return value;
  };
  CHECK(index.starts_with("VTGTILES"));
  CHECK(word(1) == 2);
  CHECK(std::bit_cast<double>(word(2)) == 5.0);
  CHECK(word(3) == 5);
  CHECK(word(4) == 4);
  CHECK(word(5) == 3);
  CHECK(word(6) == 0);
  const std::array<double, 6> bounds{1.0, -2.0, 0.5, 26.0, 7.0, 4.0};
  for (std::size_t i = 0; i < 6; ++i) CHECK(std::bit_cast<double>(word(7 + i)) == bounds[i]);
  CHECK(word(13) == 1);  // packs
  CHECK(word(14) == 2);  // tiles
  CHECK(word(15) == 2);  // cells
  CHECK(word(16) == 36);
  CHECK(word(17) == 0xffffffff00000000ULL);  // tile (0, -1)
  CHECK(word(18) == 0);
  CHECK(word(19) == 0);
  CHECK(word(20) == 2);
  CHECK(word(21) == 1);
  CHECK(word(23) == 1);  // tile (1, 0)
  CHECK(word(25) == 24);
  CHECK(word(29) == 0xffffffff00000000ULL);  // cell (0, -1)
  CHECK(word(30) == 2);
  CHECK(word(31) == 0x0000000100000005ULL);  // cell (5, 1)
  CHECK(word(32) == 1);
  const std::string pack = content_of(folder.path() / "map" / "points_0000.pack");
  CHECK(pack == raw(1.0F) + raw(-2.0F) + raw(3.0F) + raw(2.0F) + raw(-1.0F) + raw(4.0F) +
                    raw(26.0F) + raw(7.0F) + raw(0.5F));
}

TEST_CASE("tiled map: counts have 64 bits") {
  constexpr std::uint64_t kMany = std::uint64_t{1} << 33U;
  const TemporaryFolder folder;
  io::tiles::Index index;
  index.cells = {{0, 0, kMany}, {1, 0, 5}, {0, 1, kMany + 1}};
  index.bounds.extend(Point::Zero());
  io::tiles::lay_out(index, std::uint64_t{4} << 30U);
  CHECK(index.points == 2 * kMany + 6);
  CHECK(index.packs == std::vector<std::uint64_t>{12 * kMany, 60, 12 * (kMany + 1)});
  REQUIRE(io::tiles::write_index(folder.path() / "i", index));
  const auto read = io::tiles::read_index(folder.path() / "i");
  REQUIRE_MESSAGE(read, to_string(read.error()));
  CHECK(read->points == index.points);
  CHECK(read->packs == index.packs);
  CHECK(read->tiles[2].points == kMany + 1);
}

}  // namespace
}  // namespace vantage
