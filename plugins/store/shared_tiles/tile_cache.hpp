#pragma once

#include <cstdint>
#include <list>
#include <memory>
#include <mutex>
#include <optional>
#include <unordered_map>

#include "stored_tile.hpp"
#include "vantage/kit/file_content.hpp"
#include "vantage/result.hpp"

namespace vantage::shared_tiles {

/// Tiles that were read, as many of the last used as fit. What is read never depends on it: a tile
/// is found by its place and its checksum, so that one of a replaced bundle is not.
/// Thread safety: `get` may run on one object from many threads at once.
class TileCache {
 public:
  using TilePtr = std::shared_ptr<const StoredTile>;

  /// @param limit  [bytes]; 0: nothing is kept
  explicit TileCache(std::uint64_t limit) noexcept : limit_(limit) {}

  /// A tile, from the cache or from the file, which is opened when it is first needed.
  /// Errors: `corrupt_data` for a file that is missing or damaged; `io_failure`.
  [[nodiscard]] Result<TilePtr> get(const TilePlace& place, const std::filesystem::path& path,
                                    std::optional<io::InputFile>& file);

 private:
  struct Entry {
    std::uint64_t offset, checksum;
    TilePtr tile;
  };
  [[nodiscard]] TilePtr find(const TilePlace& place);
  void keep(const TilePlace& place, const TilePtr& tile);

  std::uint64_t limit_;
  std::mutex mutex_;
  std::list<Entry> entries_;  // the last used first
  std::unordered_map<std::uint64_t, std::list<Entry>::iterator> by_offset_;
  std::uint64_t bytes_ = 0;
};

}  // namespace vantage::shared_tiles
