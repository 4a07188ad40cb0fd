#pragma once

#include <cstddef>
#include <cstdint>
#include <string>
#include <string_view>

#include "common/bundle_format.hpp"
#include "vantage/map_store.hpp"
#include "vantage/result.hpp"

namespace vantage::bundle_folder {

/// The file of the regions, as `index.json` names it.
struct RegionsReference {
  std::uint64_t count = 0;  ///< of the regions
  std::uint64_t bytes = 0;
  std::uint64_t checksum = 0;  ///< of its last page, which has those of all others

  friend bool operator==(const RegionsReference&, const RegionsReference&) = default;
};

/// The content of `index.json`: what belongs to the whole bundle.
struct BundleHead {
  std::uint64_t map_points = 0;
  Bounds3 map_bounds;
  std::string config;
  RegionsReference regions;
  /// The checksum of `index.json`. It covers the checksums of all regions, so it tells bundles of
  /// different regions apart.
  std::uint64_t generation = 0;
};

/// The largest `index.json` that is written or read. All of it but the configuration is short.
inline constexpr std::size_t kMostHeadBytes = std::size_t{4} << 20U;

/// Errors: `invalid_input` for a configuration that is not UTF-8 or too long, and for NaN.
[[nodiscard]] Result<std::string> to_json(const BundleFormat& format, const BundleHead& head);

/// Errors: `corrupt_data` at the line of a syntax error; for another version; with the name of a
/// member that is missing, has another type, or contradicts the rest; for a wrong checksum.
/// @param file  the file's name in error messages
[[nodiscard]] Result<BundleHead> from_json(const BundleFormat& format, std::string_view text,
                                           const std::string& file);

}  // namespace vantage::bundle_folder
