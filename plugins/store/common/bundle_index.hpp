#pragma once

#include <cstdint>
#include <string>
#include <string_view>
#include <vector>

#include "common/bundle_format.hpp"
#include "vantage/map_store.hpp"
#include "vantage/result.hpp"

namespace vantage::bundle_folder {

/// The file of a packed index, as `index.json` names it.
struct PackedRegions {
  std::uint64_t count = 0;  ///< of the regions; 0: they are in `index.json`
  std::uint64_t bytes = 0;
  std::uint64_t checksum = 0;  ///< of its last page

  friend bool operator==(const PackedRegions&, const PackedRegions&) = default;
};

/// The content of `index.json`.
struct BundleIndex {
  MapIndex map;                   ///< without regions if they are packed
  std::vector<RegionFile> files;  ///< by RegionId; none if they are packed
  PackedRegions packed = {};
  /// The checksum of what was read: of everything in the index, which has the checksums of all
  /// regions. Bundles of different regions have different ones.
  std::uint64_t generation = 0;
};

/// The region's label and the extension.
[[nodiscard]] std::string region_file_name(const BundleFormat& format, const Region& region);

/// Whether `to_json` can write this index. Errors: `invalid_input` for a config that is not UTF-8
/// and for NaN.
[[nodiscard]] Result<void> check_writable(const MapIndex& index);

/// Errors: those of `check_writable`.
[[nodiscard]] Result<std::string> to_json(const BundleFormat& format, const BundleIndex& index);

/// Errors: `corrupt_data` at the line of a syntax error; for another version; with the name of a
/// member that is missing, has another type, or contradicts the rest; for a wrong checksum.
/// @param file  the file's name in error messages
[[nodiscard]] Result<BundleIndex> from_json(const BundleFormat& format, std::string_view text,
                                            const std::string& file);

}  // namespace vantage::bundle_folder
