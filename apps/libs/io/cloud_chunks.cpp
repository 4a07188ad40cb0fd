#include "io/cloud_chunks.hpp"

#include <algorithm>
#include <new>
#include <utility>

namespace vantage::io {

Result<CloudChunks> CloudChunks::open(const std::filesystem::path& path) {
  CloudChunks chunks;
  if (is_tiled_map(path)) {
    VANTAGE_TRY(TiledMap map, TiledMap::open(path));
    chunks.parts_.points = map.points();
    std::uint64_t most = 0;
    for (const TiledMap::Tile& tile : map.tiles()) most = std::max(most, tile.points);
    chunks.parts_.memory = 2 * sizeof(Point) * most;  // the bytes of a tile, and its points
    chunks.map_ = std::move(map);
    return chunks;
  }
  VANTAGE_TRY(InputFile input, InputFile::open(path, expected_cloud()));
  chunks.file_ = std::make_unique<InputFile>(std::move(input));
  VANTAGE_TRY(CloudFile file, CloudFile::of(*chunks.file_));
  VANTAGE_TRY(const Format* format, cloud_format(file));
  VANTAGE_TRY(chunks.parts_, format->cloud.parts(file));
  return chunks;
}

Result<std::uint64_t> CloudChunks::add(LoadedCloud& cloud, std::uint64_t position,
                                       std::uint64_t most) {
  if (map_) return add_of_tiles(cloud, position, most);
  if (parts_.records) {
    const std::uint64_t count = std::min(most, parts_.records->count - position);
    VANTAGE_CHECK(add_records(cloud, *file_, *parts_.records, position, count));
    return count;
  }
  if (!whole_) {
    VANTAGE_TRY(whole_, read_point_cloud(*file_));
  }
  if (position == 0) cloud.dropped += std::exchange(whole_->dropped, 0);
  if (position > whole_->points.size()) {
    return fail(ErrorCode::io_failure, "the file changed while it was read",
                SourceLocation{file_->name(), 0, 0});
  }
  const auto first = whole_->points.begin() + static_cast<std::ptrdiff_t>(position);
  const std::uint64_t count = std::min<std::uint64_t>(most, whole_->points.size() - position);
  cloud.points.insert(cloud.points.end(), first, first + static_cast<std::ptrdiff_t>(count));
  return count;
}

Result<std::uint64_t> CloudChunks::add_of_tiles(LoadedCloud& cloud, std::uint64_t position,
                                                std::uint64_t most) {
  if (position < tile_first_ || position >= tile_first_ + tile_.size()) {
    tile_ = PointCloud();
    const auto tiles = map_->tiles();
    const auto after = std::upper_bound(
        tiles.begin(), tiles.end(), position,
        [](std::uint64_t at, const TiledMap::Tile& tile) { return at < tile.first; });
    if (position >= map_->points() || after == tiles.begin()) return 0;
    const TiledMap::Tile& tile = *(after - 1);
    VANTAGE_TRY(tile_, map_->read(tile.index));
    tile_first_ = tile.first;
  }
  const std::uint64_t from = position - tile_first_;
  const std::uint64_t count = std::min<std::uint64_t>(most, tile_.size() - from);
  const auto begin = tile_.begin() + static_cast<std::ptrdiff_t>(from);
  cloud.points.insert(cloud.points.end(), begin, begin + static_cast<std::ptrdiff_t>(count));
  return count;
}

}  // namespace vantage::io
