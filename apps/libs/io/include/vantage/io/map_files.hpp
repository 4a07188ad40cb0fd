#pragma once

#include <cstdint>
#include <filesystem>
#include <span>
#include <vector>

#include "vantage/result.hpp"

namespace vantage::io {

/// The point cloud files that together form a map.
struct MapFiles {
  std::vector<std::filesystem::path> files;  ///< each listed once
  std::uint64_t unlisted_tiles = 0;  ///< files beside Autoware's tiles that are not in the metadata
};

/// Finds the files that patterns name, in the order of the patterns. A pattern may be:
/// - a file
/// - a tiled map, which is a folder: gives this folder, see TiledMap
/// - a folder of tiles with Autoware's metadata in it or beside it: gives the tiles that the
///   metadata list
/// - any other folder: gives its .pcd, .ply and .las files (and .laz and .e57, which a reader
///   refuses)
/// - a name with `*`, `?` or `[...]` that matches names in one folder; a match may be any of the
///   above. A path that exists is taken literally.
/// The files of one folder or pattern are in natural order (less_by_natural_order).
/// Errors (`where` is the pattern or folder): `not_found` for a pattern that matches nothing, a
/// folder without such files, or a listed tile that does not exist; `corrupt_data` for malformed
/// metadata; `io_failure`.
[[nodiscard]] Result<MapFiles> map_files(std::span<const std::filesystem::path> patterns);

}  // namespace vantage::io
