#pragma once

#include <optional>
#include <string>
#include <string_view>

#include "io/point_fields.hpp"
#include "vantage/io/point_cloud_io.hpp"

namespace vantage::io {

/// Whether the content starts like a PCD or PLY file.
[[nodiscard]] bool looks_like_pcd(std::string_view content) noexcept;
[[nodiscard]] bool looks_like_ply(std::string_view content) noexcept;

/// The readers behind read_point_cloud. They take the content of a file, and its name for errors.
[[nodiscard]] Result<LoadedCloud> parse_pcd(std::string_view content, const std::string& file,
                                            ReadTimes read_times);
[[nodiscard]] Result<LoadedCloud> parse_ply(std::string_view content, const std::string& file,
                                            ReadTimes read_times);
[[nodiscard]] Result<LoadedCloud> parse_kitti_bin(std::string_view content,
                                                  const std::string& file);

/// The layouts behind read_cloud_layout.
[[nodiscard]] Result<CloudLayout> pcd_layout(std::string_view content, const std::string& file);
[[nodiscard]] Result<CloudLayout> ply_layout(std::string_view content, const std::string& file);

/// Where the points of a sound binary file are, if the file can be read in parts; nothing for any
/// other file.
/// @param head  the beginning of the file
/// @param size  of the file [bytes]
[[nodiscard]] std::optional<Records> pcd_records(std::string_view head, std::size_t size,
                                                 ReadTimes read_times);
[[nodiscard]] std::optional<Records> ply_records(std::string_view head, std::size_t size,
                                                 ReadTimes read_times);

}  // namespace vantage::io
