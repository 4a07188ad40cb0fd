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

/// The map of the Gaussians that `encode` was given, with the same bits, counted from an origin
/// in their middle.
/// Errors: `corrupt_data` for bytes that `encode` does not make; `invalid_input` if the options
/// differ from `wanted`; `too_few_matches` for no Gaussians.
[[nodiscard]] Result<VoxelMap> decode(std::span<const std::byte> bytes, const VoxelOptions& wanted);

}  // namespace vantage::ndt
