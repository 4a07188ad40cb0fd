#pragma once

#include <string>
#include <string_view>
#include <vector>

#include "tile.hpp"
#include "vantage/map_store.hpp"
#include "vantage/result.hpp"

namespace vantage::pcd_tiles {

/// The content of `index.json`.
struct BundleIndex {
  MapIndex map;
  std::vector<TileInfo> tiles;  ///< by RegionId
};

/// `<label>.pcd`.
[[nodiscard]] std::string tile_name(const Region& region);

/// Errors: `invalid_input` for a config that is not UTF-8 and for NaN.
[[nodiscard]] Result<std::string> to_json(const BundleIndex& index);

/// Errors: `corrupt_data` at the line of a syntax error, or with the name of the member that is
/// missing, of another type, or contradicts the rest, or because the checksum does.
/// @param file  what error messages call it
[[nodiscard]] Result<BundleIndex> from_json(std::string_view text, const std::string& file);

}  // namespace vantage::pcd_tiles
