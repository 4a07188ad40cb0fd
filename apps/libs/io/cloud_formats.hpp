#pragma once

#include <cstddef>
#include <optional>
#include <string>
#include <string_view>

#include "io/formats.hpp"

namespace vantage::io {

/// Whether the content starts like a PCD or PLY file.
[[nodiscard]] bool looks_like_pcd(std::string_view content) noexcept;
[[nodiscard]] bool looks_like_ply(std::string_view content) noexcept;

/// Reads in blocks what `records_in` knows from the beginning and the size of a file, and parses
/// anything else as a whole.
/// @param parse  the content of a file, and its name for errors
[[nodiscard]] Result<LoadedCloud> read_blocks_or_all(
    CloudFile& file, ReadTimes read_times,
    std::optional<Records> (*records_in)(std::string_view head, std::size_t size, ReadTimes),
    Result<LoadedCloud> (*parse)(std::string_view content, const std::string& file, ReadTimes));

/// The readers behind read_point_cloud; their errors are its errors. Points of a sound binary file
/// are read in blocks, the file is never in memory as a whole.
[[nodiscard]] Result<LoadedCloud> read_pcd(CloudFile& file, ReadTimes read_times);
[[nodiscard]] Result<LoadedCloud> read_ply(CloudFile& file, ReadTimes read_times);
[[nodiscard]] Result<LoadedCloud> read_las(CloudFile& file, ReadTimes read_times);
[[nodiscard]] Result<LoadedCloud> read_e57(CloudFile& file, ReadTimes read_times);
[[nodiscard]] Result<LoadedCloud> read_kitti_bin(CloudFile& file, ReadTimes read_times);

/// What CloudChunks knows of a file before it reads points.
[[nodiscard]] Result<CloudParts> pcd_parts(const CloudFile& file);
[[nodiscard]] Result<CloudParts> ply_parts(const CloudFile& file);
[[nodiscard]] Result<CloudParts> las_parts(const CloudFile& file);
[[nodiscard]] Result<CloudParts> e57_parts(const CloudFile& file);
[[nodiscard]] Result<CloudParts> kitti_bin_parts(const CloudFile& file);

/// What is read as a whole: its bytes and its points [bytes].
[[nodiscard]] constexpr std::uint64_t memory_of(std::uint64_t bytes,
                                                std::uint64_t points) noexcept {
  return bytes + points * sizeof(Point);
}

/// The layouts behind read_cloud_layout.
[[nodiscard]] Result<CloudLayout> pcd_layout(const CloudFile& file);
[[nodiscard]] Result<CloudLayout> ply_layout(const CloudFile& file);
[[nodiscard]] Result<CloudLayout> las_layout(const CloudFile& file);
[[nodiscard]] Result<CloudLayout> e57_layout(const CloudFile& file);
[[nodiscard]] Result<CloudLayout> kitti_bin_layout(const CloudFile& file);

}  // namespace vantage::io
