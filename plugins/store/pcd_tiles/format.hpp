#pragma once

#include "common/bundle_format.hpp"
#include "tile.hpp"

namespace vantage::pcd_tiles {

inline constexpr bundle_folder::BundleFormat kFormat{
    .store = "pcd_tiles", .version = 6, .extension = ".pcd", .file_size = &file_size};

}  // namespace vantage::pcd_tiles
