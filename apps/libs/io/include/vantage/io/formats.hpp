#pragma once

#include <cstdint>
#include <string>
#include <string_view>
#include <vector>

namespace vantage::io {

/// What files of a format can be read as.
enum class FormatUse : std::uint8_t {
  cloud,       ///< by read_point_cloud
  scan,        ///< one scan of a folder, by open_scans
  map,         ///< one file of a map folder, by map_files
  recording,   ///< by open_scans
  trajectory,  ///< by read_sensor_trajectory
  imu,         ///< by read_imu
};
[[nodiscard]] std::string_view to_string(FormatUse use) noexcept;

/// A format that is read, or that is refused with the name of a converter.
struct FormatDescription {
  std::string_view name;  ///< "PCD"
  std::vector<std::string_view>
      extensions;               ///< in lower case: ".pcd"; empty if names do not matter
  std::vector<FormatUse> uses;  ///< empty for a format that is refused
  std::string_view help;        ///< the variants that are read, or a converter
};

/// All formats, in the order in which messages list them.
[[nodiscard]] std::vector<FormatDescription> formats();

/// The formats of a use as a list for users, each once: "PCD, PLY, LAS or KITTI .bin".
/// @param last  separates the last two names
[[nodiscard]] std::string format_names(FormatUse use, std::string_view last = " or ");

}  // namespace vantage::io
