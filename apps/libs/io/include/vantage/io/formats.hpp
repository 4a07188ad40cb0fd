#pragma once

#include <cstdint>
#include <string>
#include <string_view>
#include <vector>

namespace vantage::io {

/// What files of a format are read as.
enum class FormatUse : std::uint8_t {
  cloud,       ///< by read_point_cloud
  scan,        ///< one scan of a folder, by open_scans
  map,         ///< one file of a map's folder, by map_files
  recording,   ///< by open_scans
  trajectory,  ///< by read_sensor_trajectory
};
[[nodiscard]] std::string_view to_string(FormatUse use) noexcept;

/// A format that is read, or is refused with a converter.
struct FormatDescription {
  std::string_view name;  ///< "PCD"
  std::vector<std::string_view>
      extensions;               ///< in lower case: ".pcd"; none where names say nothing
  std::vector<FormatUse> uses;  ///< none for a format that is refused
  std::string_view help;        ///< which variants of it are read
};

/// All formats, in the order in which messages list them.
[[nodiscard]] std::vector<FormatDescription> formats();

/// "PCD, PLY, LAS or KITTI .bin": the formats of a use, in a user's words, each once.
/// @param last  between the last two
[[nodiscard]] std::string format_names(FormatUse use, std::string_view last = " or ");

}  // namespace vantage::io
