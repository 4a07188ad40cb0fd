#include "region_reader.hpp"

#include <optional>
#include <utility>
#include <vector>

#include "point_order.hpp"
#include "region_content.hpp"

namespace vantage::shared_tiles {

Result<RegionMap> read_region(std::string_view content, const bundle_folder::RegionFile& file,
                              const std::filesystem::path& path, const std::filesystem::path& tiles,
                              TileCache& cache) {
  const auto corrupt = [&](const char* reason) {
    return fail(ErrorCode::corrupt_data, reason, SourceLocation{path.string(), 0, 0});
  };
  VANTAGE_TRY(RegionContent region, decode_region(content, file, path.string()));
  std::optional<io::InputFile> tiles_file;
  std::vector<TileCache::TilePtr> in_use;  // until the points are there
  TakenPoints taken;
  in_use.reserve(region.parts.size());
  for (const TilePart& part : region.parts) {
    auto tile = cache.get(part.place, tiles, tiles_file);
    if (!tile) {
      return fail(std::move(tile).error().during("reading region '" + path.stem().string() + "'"));
    }
    auto runs = read_selection(part.selection, part.coding, (*tile)->points, part.count);
    if (!runs) return corrupt("the selection from a tile is damaged");
    taken.add(**tile, *std::move(runs));
    in_use.push_back(*std::move(tile));
  }
  auto points = taken.in_order(region.order);
  if (!points) return corrupt("the order of the points is damaged");
  region.map.points = *std::move(points);
  return std::move(region.map);
}

}  // namespace vantage::shared_tiles
