#pragma once

#include <Eigen/Core>

#include "block_table.hpp"
#include "voxel_map.hpp"

// What a map of voxels that was stored must keep to.
namespace vantage::ndt {

/// Of an axis, the bits of a key (see key_of_shifted).
[[nodiscard]] constexpr VoxelKey bits_of_axis(unsigned axis) {
  return VoxelKey{0x7FFFFU} << (44U - 19U * axis) | VoxelKey{3} << (4U - 2U * axis);
}
/// Whether a map can hold a voxel of this key.
[[nodiscard]] inline bool is_voxel(VoxelKey key) {
  // The first index and the last, which has all bits, are out of range.
  static_assert(kIndexEnd == (1U << 21U) - 1U);
  const auto in_range = [&](VoxelKey bits) { return (key & bits) != 0 && (key & bits) != bits; };
  return key >> 63U == 0 && in_range(bits_of_axis(0)) && in_range(bits_of_axis(1)) &&
         in_range(bits_of_axis(2));
}

/// Whether voxels can be counted from here: whole numbers.
[[nodiscard]] inline bool is_origin(const Eigen::Vector3d& voxel) {
  return (voxel.array().abs() < 0x1p53).all() && voxel == voxel.array().round().matrix();
}

}  // namespace vantage::ndt
