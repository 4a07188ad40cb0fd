#include "info/tiled_info.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <nlohmann/json.hpp>
#include <utility>

#include "info/lines.hpp"
#include "terminal/table.hpp"
#include "vantage/kit/file_system.hpp"

namespace vantage {
namespace {

constexpr const char* kTiledMap = "tiled map";

struct TilePoints {
  std::uint64_t fewest = 0, most = 0;
};

TilePoints tile_points(const io::TiledMap& map) {
  const auto [fewest, most] =
      std::minmax_element(map.tiles().begin(), map.tiles().end(),
                          [](const auto& a, const auto& b) { return a.points < b.points; });
  return fewest == map.tiles().end() ? TilePoints{} : TilePoints{fewest->points, most->points};
}

const char* precision_of(const io::TiledMap& map) {
  return map.precision() == io::Precision::float32 ? "float32" : "float64";
}

}  // namespace

Result<std::optional<TiledInfo>> inspect_tiled_map(
    const std::filesystem::path& path,
    const std::function<void(std::size_t, std::size_t)>& progress) {
  if (!io::is_tiled_map(path)) return std::nullopt;
  VANTAGE_TRY(io::TiledMap map, io::TiledMap::open(path));
  for (const io::TiledMap::Tile& tile : map.tiles()) {
    VANTAGE_CHECK(map.read(tile.index));
    if (progress) progress(tile.first + tile.points, map.points());
  }
  return TiledInfo{.bytes = io::bytes_of(path), .map = std::move(map)};
}

std::string to_text(const TiledInfo& info, const cli::Style& style) {
  const io::TiledMap& map = info.map;
  const TilePoints points = tile_points(map);
  Lines lines{{"path", map.folder().string()},
              {"format", kTiledMap},
              {"size [MB]", fmt::format("{:.2f}", static_cast<double>(info.bytes) / 1e6)},
              {"points", cli::grouped(map.points())},
              {"precision", precision_of(map)}};
  lines.emplace_back("NaN or infinite", cli::grouped(map.dropped()) + " left out");
  lines.emplace_back("extent [m]",
                     box_text(Eigen::AlignedBox3d(map.bounds().min, map.bounds().max)));
  lines.emplace_back("tiles", fmt::format("{} of {:g} m, in {}", cli::grouped(map.tiles().size()),
                                          map.tile_size(), cli::counted(map.packs(), "pack")));
  lines.emplace_back(
      "points a tile",
      fmt::format("{} ({} to {})",
                  cli::grouped(map.points() / std::max<std::size_t>(1, map.tiles().size())),
                  cli::grouped(points.fewest), cli::grouped(points.most)));
  lines.emplace_back("cells",
                     fmt::format("{} of {:g} m", cli::grouped(map.cells()), io::kCanonicalCell));
  lines.emplace_back("checksums", "those of all tiles fit");
  return to_text(lines, style);
}

nlohmann::ordered_json to_json(const TiledInfo& info) {
  const io::TiledMap& map = info.map;
  const auto corner = [](const Point& p) { return std::array{p.x(), p.y(), p.z()}; };
  const TilePoints points = tile_points(map);
  return {{"path", map.folder().string()},
          {"format", kTiledMap},
          {"bytes", info.bytes},
          {"points", map.points()},
          {"dropped_points", map.dropped()},
          {"precision", precision_of(map)},
          {"min", corner(map.bounds().min)},
          {"max", corner(map.bounds().max)},
          {"tile_size", map.tile_size()},
          {"tiles", map.tiles().size()},
          {"packs", map.packs()},
          {"fewest_points", points.fewest},
          {"most_points", points.most},
          {"cells", map.cells()}};
}

}  // namespace vantage
