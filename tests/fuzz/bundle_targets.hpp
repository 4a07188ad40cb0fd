#pragma once

#include <optional>
#include <string_view>

#include "build/build_identity.hpp"
#include "vantage/error.hpp"

/// Readers of the files of bundles and of builds in parts. Each target puts the checksums right
/// before it reads the input: otherwise they would refuse all damage, and the code behind them
/// would never see it.
namespace vantage::test::bundle_targets {

/// `index.json`.
[[nodiscard]] std::optional<Error> read_index(std::string_view input);
/// `regions.idx`.
[[nodiscard]] std::optional<Error> read_regions(std::string_view input);
/// The plan of a build in parts.
[[nodiscard]] std::optional<Error> read_plan(std::string_view input);
/// A file of parts.
[[nodiscard]] std::optional<Error> read_parts(std::string_view input);
/// A tiled map of one pack: the index and the pack, each after its size (uint32).
[[nodiscard]] std::optional<Error> read_pack(std::string_view input);
/// A region of `shared_tiles`: what the index says of it (RegionCounts), its file after its size
/// (uint32), the file of tiles.
[[nodiscard]] std::optional<Error> read_shared_region(std::string_view input);
/// A region of `pcd_tiles`: RegionCounts, its file.
[[nodiscard]] std::optional<Error> read_pcd_region(std::string_view input);

/// What an index says of a region but its size and its checksum.
struct RegionCounts {
  std::uint64_t points, viewpoints, elements, prepared_bytes;
  double origin[3];
  std::uint64_t max_views;
};

/// Of the plans and parts that are seeds.
inline constexpr std::uint64_t kFuzzedKey = 0x1234'5678'9abc'def0;
inline const BuildIdentity kFuzzedBuild{{{"map", 17}, {"configuration", kFuzzedKey}}};

}  // namespace vantage::test::bundle_targets
