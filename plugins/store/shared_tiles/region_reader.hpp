#pragma once

#include <filesystem>
#include <string_view>

#include "common/bundle_format.hpp"
#include "vantage/map_store.hpp"
#include "vantage/result.hpp"

namespace vantage::shared_tiles {

/// A region from its file and from the tiles that it names.
/// @param content  of the region's file
/// @param path     of the region's file, for messages
/// @param tiles    the file of tiles
/// Errors: `corrupt_data`; `io_failure`.
[[nodiscard]] Result<RegionMap> read_region(std::string_view content,
                                            const bundle_folder::RegionFile& file,
                                            const std::filesystem::path& path,
                                            const std::filesystem::path& tiles);

}  // namespace vantage::shared_tiles
