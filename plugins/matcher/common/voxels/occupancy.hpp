#pragma once

#include <cstddef>
#include <cstdint>
#include <optional>
#include <span>
#include <vector>

#include "block_table.hpp"

namespace vantage::ndt {

/// Which voxels are occupied, in two to three bits a voxel: an octree whose nodes are coded with
/// what their neighbours are.
/// @param keys  of the voxels; any order, all different
[[nodiscard]] std::vector<std::byte> encode_occupancy(std::span<const std::uint64_t> keys);

/// The keys that `encode_occupancy` was given, ascending.
/// @param count  < 2^32
/// @return  nothing for other bytes, or for another number of voxels than `count`
[[nodiscard]] std::optional<std::vector<std::uint64_t>> decode_occupancy(
    std::span<const std::byte> bytes, std::size_t count);

}  // namespace vantage::ndt
