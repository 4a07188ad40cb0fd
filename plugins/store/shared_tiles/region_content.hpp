#pragma once

#include <cstdint>
#include <string>
#include <string_view>
#include <vector>

#include "common/bundle_format.hpp"
#include "selection.hpp"
#include "stored_tile.hpp"
#include "vantage/map_store.hpp"

/// The file of one region: what only this region has, and behind it which points of which tiles it
/// has.
namespace vantage::shared_tiles {

/// Points of a tile.
struct TilePart {
  TilePlace place;
  std::uint32_t count = 0;  ///< of the points that are taken
  Coding coding = Coding::all;
  std::string_view selection;  ///< the code
};

/// The content of a region's file. It borrows from the file.
struct RegionContent {
  RegionMap map;  ///< without its points
  std::vector<TilePart> parts;
  std::string_view order;  ///< the code
};

/// The first part of the file: viewpoints, views, prepared bytes. Whole words.
[[nodiscard]] std::string encode_head(const RegionMap& map, const bundle_folder::RegionFile& file);

/// The second part of the file. Whole words. @param order  the code
[[nodiscard]] std::string encode_parts(const std::vector<TilePart>& parts, std::string_view order);

/// Checks every byte. Errors: `corrupt_data` for content that does not agree with `file`.
[[nodiscard]] Result<RegionContent> decode_region(std::string_view content,
                                                  const bundle_folder::RegionFile& file,
                                                  const std::string& path);

}  // namespace vantage::shared_tiles
