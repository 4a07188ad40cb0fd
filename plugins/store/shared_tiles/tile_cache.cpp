#include "tile_cache.hpp"

#include <string>
#include <utility>

#include "bytes.hpp"

namespace vantage::shared_tiles {
namespace {

Result<TileCache::TilePtr> read_tile(const TilePlace& place, const std::filesystem::path& path,
                                     std::optional<io::InputFile>& file) {
  const auto corrupt = [&](const std::string& reason) {
    return fail(ErrorCode::corrupt_data,
                "the tile at byte " + std::to_string(place.offset) + " " + reason,
                SourceLocation{path.string(), 0, 0});
  };
  if (!file) {
    auto opened = io::InputFile::open(path, "a regular file", io::InputFile::Empty::accept);
    if (!opened && opened.error().code == ErrorCode::not_found) {
      return corrupt("cannot be read: the file is missing");
    }
    if (!opened) return fail(std::move(opened).error());
    file.emplace(*std::move(opened));
  }
  if (place.offset > file->size() || place.bytes > file->size() - place.offset) {
    return corrupt("has " + std::to_string(place.bytes) + " bytes, but the file ends after " +
                   std::to_string(file->size()));
  }
  auto tile = std::make_shared<StoredTile>();
  tile->bytes = std::make_unique_for_overwrite<char[]>(place.bytes);
  tile->size = place.bytes;
  const std::span<char> bytes(tile->bytes.get(), place.bytes);
  VANTAGE_CHECK(file->read(place.offset, bytes));
  if (sum_of({bytes.data(), bytes.size()}).value() != place.checksum) {
    return corrupt("has another checksum than the region says: the file is damaged");
  }
  if (!decode_tile(*tile)) return corrupt("is not a tile");
  return TileCache::TilePtr(std::move(tile));
}

}  // namespace

Result<TileCache::TilePtr> TileCache::get(const TilePlace& place, const std::filesystem::path& path,
                                          std::optional<io::InputFile>& file) {
  if (TilePtr tile = find(place)) return tile;
  VANTAGE_TRY(TilePtr tile, read_tile(place, path, file));
  keep(place, tile);
  return tile;
}

TileCache::TilePtr TileCache::find(const TilePlace& place) {
  const std::scoped_lock lock(mutex_);
  const auto found = by_offset_.find(place.offset);
  if (found == by_offset_.end()) return nullptr;
  const auto entry = found->second;
  if (entry->checksum != place.checksum || entry->tile->size != place.bytes) return nullptr;
  entries_.splice(entries_.begin(), entries_, entry);
  return entry->tile;
}

void TileCache::keep(const TilePlace& place, const TilePtr& tile) {
  if (tile->memory() > limit_) return;
  const std::scoped_lock lock(mutex_);
  const auto drop = [&](std::list<Entry>::iterator entry) {
    bytes_ -= entry->tile->memory();
    by_offset_.erase(entry->offset);
    entries_.erase(entry);
  };
  if (const auto found = by_offset_.find(place.offset); found != by_offset_.end()) {
    drop(found->second);
  }
  entries_.push_front({place.offset, place.checksum, tile});
  by_offset_[place.offset] = entries_.begin();
  bytes_ += tile->memory();
  while (bytes_ > limit_) drop(std::prev(entries_.end()));
}

}  // namespace vantage::shared_tiles
