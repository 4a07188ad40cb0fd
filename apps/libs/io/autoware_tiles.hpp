#pragma once

#include <cstdint>
#include <string>
#include <string_view>
#include <vector>

#include "vantage/result.hpp"

namespace vantage::io {

/// Autoware's names for the folder of a map's tiles and for the file beside it that lists them.
inline constexpr const char* kAutowareFolder = "pointcloud_map.pcd";
inline constexpr const char* kAutowareMetadata = "pointcloud_map_metadata.yaml";

/// One file of a map that is cut along a grid.
struct AutowareTile {
  std::string file;    ///< a name without a folder
  std::int64_t x = 0;  ///< lower-left corner [m]
  std::int64_t y = 0;
  friend bool operator==(const AutowareTile&, const AutowareTile&) = default;
};

/// The content of pointcloud_map_metadata.yaml (Autoware, map_loader: "Specifications on
/// metadata").
struct AutowareTiles {
  double x_resolution = 0.0;  ///< of a tile [m]; > 0
  double y_resolution = 0.0;
  std::vector<AutowareTile> tiles;  ///< in the order of the file
  friend bool operator==(const AutowareTiles&, const AutowareTiles&) = default;
};

/// Treats every key except the two resolutions as a tile, as Autoware does.
/// @param file  for errors
/// Errors (`where` is the line): `corrupt_data` for text that is not YAML, or not a mapping of two
/// resolutions and of file names to two whole numbers; for a name that occurs twice or leaves the
/// folder.
[[nodiscard]] Result<AutowareTiles> parse_autoware_tiles(std::string_view yaml,
                                                         const std::string& file);

[[nodiscard]] std::string to_yaml(const AutowareTiles& tiles);

}  // namespace vantage::io
