#include "region_reader.hpp"

#include <string>
#include <utility>
#include <vector>

#include "bytes.hpp"
#include "point_order.hpp"
#include "region_content.hpp"
#include "vantage/kit/checksum.hpp"
#include "vantage/kit/file_content.hpp"

namespace vantage::shared_tiles {
namespace {

Result<io::InputFile> open_tiles(const std::filesystem::path& path) {
  auto opened = io::InputFile::open(path, "a regular file", io::InputFile::Empty::accept);
  if (opened || opened.error().code != ErrorCode::not_found) return opened;
  return fail(ErrorCode::corrupt_data, "the tiles cannot be read: the file is missing",
              SourceLocation{path.string(), 0, 0});
}

tl::unexpected<Error> corrupt_tile(const TilePlace& place, const io::InputFile& file,
                                   const std::string& reason) {
  return fail(ErrorCode::corrupt_data,
              "the tile at byte " + std::to_string(place.offset) + " " + reason,
              SourceLocation{file.name(), 0, 0});
}

/// Whether the file has room for the tiles, which do not overlap: then a region has no more points
/// than fit into the file.
Result<void> check_places(const std::vector<TilePart>& parts, const io::InputFile& file) {
  for (const TilePart& part : parts) {
    const TilePlace& place = part.place;
    if (place.offset <= file.size() && place.bytes <= file.size() - place.offset) continue;
    return corrupt_tile(place, file,
                        "has " + std::to_string(place.bytes) + " bytes, but the file ends after " +
                            std::to_string(file.size()));
  }
  return {};
}

/// Errors: `corrupt_data` for a tile that is not there as the region says; `io_failure`.
Result<StoredTile> read_tile(const TilePlace& place, const io::InputFile& file) {
  StoredTile tile;
  tile.bytes = std::make_unique_for_overwrite<char[]>(place.bytes);
  tile.size = place.bytes;
  const std::span<char> bytes(tile.bytes.get(), place.bytes);
  VANTAGE_CHECK(file.read(place.offset, bytes));
  if (checksum_of({bytes.data(), bytes.size()}) != place.checksum) {
    return corrupt_tile(place, file,
                        "has another checksum than the region says: the file is damaged");
  }
  if (!decode_tile(tile)) return corrupt_tile(place, file, "is not a tile");
  return tile;
}

}  // namespace

Result<RegionMap> read_region(std::string_view content, const bundle_folder::RegionFile& file,
                              const std::filesystem::path& path,
                              const std::filesystem::path& tiles) {
  const auto corrupt = [&](const char* reason) {
    return fail(ErrorCode::corrupt_data, reason, SourceLocation{path.string(), 0, 0});
  };
  VANTAGE_TRY(RegionContent region, decode_region(content, file, path.string()));
  std::vector<std::uint32_t> counts;
  for (const TilePart& part : region.parts) counts.push_back(part.count);
  const auto pieces = read_order(region.order, counts);
  if (!pieces) return corrupt("the order of the points is damaged");
  if (region.parts.empty()) return std::move(region.map);
  // One tile after another, so that the points and one tile are in memory.
  const auto read = [&]() -> Result<void> {
    VANTAGE_TRY(const io::InputFile tiles_file, open_tiles(tiles));
    VANTAGE_CHECK(check_places(region.parts, tiles_file));
    PointCloud& points = region.map.points;
    points.resize(file.points);
    for (std::size_t i = 0; i < region.parts.size(); ++i) {
      const TilePart& part = region.parts[i];
      VANTAGE_TRY(const StoredTile tile, read_tile(part.place, tiles_file));
      const auto runs = read_selection(part.selection, part.coding, tile.points, part.count);
      if (!runs) return corrupt("the selection from a tile is damaged");
      place_points(tile, *runs, (*pieces)[i], points);
    }
    return {};
  };
  if (auto done = read(); !done) {
    return fail(std::move(done).error().during("reading region '" + path.stem().string() + "'"));
  }
  return std::move(region.map);
}

}  // namespace vantage::shared_tiles
