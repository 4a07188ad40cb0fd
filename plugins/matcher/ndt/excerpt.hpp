#pragma once

#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

#include "vantage/result.hpp"
#include "voxel_map.hpp"

namespace vantage::ndt {

/// The Gaussians whose voxels contain at least one of the points, ascending.
/// @param seen  map frame [m], finite
[[nodiscard]] std::vector<std::uint32_t> gaussians_at(const VoxelMap& map, PointsView seen);

/// Some Gaussians of a map as bytes, about 22 bytes each; README.md describes the format.
/// @param which  ascending indices
[[nodiscard]] std::vector<std::byte> encode(const VoxelMap& map,
                                            std::span<const std::uint32_t> which);

/// The same, but only some of the Gaussians are kept, in about 14 bytes each; of the others it
/// remains that their voxels are occupied, in about 3 bits each.
/// @param which  ascending indices
/// @param kept   some of them, ascending
[[nodiscard]] std::vector<std::byte> encode_some(const VoxelMap& map,
                                                 std::span<const std::uint32_t> which,
                                                 std::span<const std::uint32_t> kept);

/// The map of the Gaussians that `encode` was given, with the same bits, counted from an origin
/// in their middle; or that of `encode_some`, whose Gaussians are off by 2^-13 voxel edges.
/// Errors: `corrupt_data` for bytes that `encode` does not make; `invalid_input` if the options
/// differ from `wanted`; `too_few_matches` for no Gaussians.
[[nodiscard]] Result<VoxelMap> decode(std::span<const std::byte> bytes, const VoxelOptions& wanted);

}  // namespace vantage::ndt
