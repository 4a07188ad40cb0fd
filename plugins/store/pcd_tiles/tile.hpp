#pragma once

#include <cstdint>
#include <filesystem>
#include <string>
#include <string_view>

#include "common/bundle_format.hpp"
#include "vantage/map_store.hpp"
#include "vantage/result.hpp"

namespace vantage::pcd_tiles {

using bundle_folder::RegionFile, bundle_folder::Sink;

/// Writes a binary PCD v0.7 of the points, x y z float32, then views uint32 if the map has view
/// counts, little endian. Behind the PCD data come the viewpoints, x y z, and the prepared bytes,
/// filled up with zeros to whole words. Works in blocks: the whole file is never in memory.
/// Errors: `invalid_input`, before anything is written, for a coordinate that is not finite or too
/// far from the others for float32, for view counts that are 0 or not one per point, and for
/// elements without bytes; those of the sink.
[[nodiscard]] Result<RegionFile> encode(const RegionMap& map, const Sink& sink);

/// Checks every byte. Errors: `corrupt_data` for content that does not agree with `info`.
/// @param file  the file's name in error messages
[[nodiscard]] Result<RegionMap> decode(std::string_view content, const RegionFile& info,
                                       const std::filesystem::path& file);

/// The size of the file that `encode` would make for a map with these counts and this origin.
/// Precondition: the counts are not above the limits.
[[nodiscard]] std::uint64_t file_size(const RegionFile& info);

}  // namespace vantage::pcd_tiles
