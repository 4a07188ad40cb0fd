#pragma once

#include <cstdint>
#include <filesystem>
#include <span>
#include <vector>

#include "vantage/result.hpp"

namespace vantage::io {

/// The point cloud files that together are a map.
struct MapFiles {
  std::vector<std::filesystem::path> files;  ///< each once
  std::uint64_t unlisted_tiles = 0;  ///< files beside Autoware's tiles that its metadata leave out
};

/// Finds the files that patterns name, in the order of the patterns:
/// - a file
/// - a folder of tiles with Autoware's metadata in it or beside it: the tiles listed there
/// - any other folder: its .pcd, .ply and .las files (and .laz and .e57, which a reader refuses)
/// - a pattern with `*`, `?` or `[...]` for what is in one folder's names; what it matches may be
///   any of the above. A path that exists is meant literally.
/// What comes of one folder or pattern is in natural order (less_by_natural_order).
/// Errors (`where` is the pattern or folder): `not_found` for a pattern that matches nothing, a
/// folder without such files and a listed tile that is not there; `corrupt_data` for malformed
/// metadata; `io_failure`.
[[nodiscard]] Result<MapFiles> map_files(std::span<const std::filesystem::path> patterns);

}  // namespace vantage::io
