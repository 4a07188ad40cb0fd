#pragma once

#include <cstddef>
#include <cstdint>

namespace vantage::ndt {

/// A block of 4 x 4 x 4 voxels, with one bit for each voxel that has a Gaussian. Gaussians lie in
/// the order of blocks and bits, so the number of a voxel's Gaussian is `first` plus the number of
/// set bits below its own. A slot of the table without a bit in either mask is free.
struct Block {
  std::uint64_t key = 0;
  std::uint64_t voxels = 0;
  std::uint64_t bare = 0;  ///< voxels that are known to be occupied, whose Gaussian was not kept
  std::uint32_t first = 0;
};

/// A hash table of blocks with open addressing; at least one slot is free.
struct BlockTable {
  const Block* slots = nullptr;
  std::uint64_t mask = 0;
  std::uint32_t shift = 0;
};

/// Voxel indices count from the map's origin; after the shift, coordinates inside the map are in
/// [1, kIndexEnd).
inline constexpr std::int32_t kHalfRange = 1 << 20;
inline constexpr std::uint32_t kIndexEnd = (1U << 21U) - 1U;
inline constexpr std::uint32_t kNoGaussian = ~std::uint32_t{0};

// This header is compiled for several instruction sets. Its functions are `static`, so that the
// copy for one instruction set cannot replace the copy for another.

/// The key of a voxel from its shifted indices: the block in the high bits, the place in the block
/// in the low six bits.
static inline std::uint64_t key_of_shifted(std::uint32_t x, std::uint32_t y, std::uint32_t z) {
  const std::uint64_t block =
      (std::uint64_t{x >> 2U} << 38U) | (std::uint64_t{y >> 2U} << 19U) | (z >> 2U);
  return (block << 6U) | ((x & 3U) << 4U) | ((y & 3U) << 2U) | (z & 3U);
}

/// Fibonacci hashing: the high bits are the well-mixed ones.
static inline std::uint64_t slot_of(std::uint64_t block, std::uint32_t shift) {
  return (block * 0x9E3779B97F4A7C15U) >> shift;
}

static inline bool is_free(const Block& block) { return (block.voxels | block.bare) == 0; }

/// The block with that key, or a free slot, which has no voxels.
static inline const Block& block_at(const BlockTable& table, std::uint64_t key) {
  std::uint64_t slot = slot_of(key, table.shift);
  while (!is_free(table.slots[slot]) && table.slots[slot].key != key) {
    slot = (slot + 1) & table.mask;
  }
  return table.slots[slot];
}

/// The Gaussian of a voxel of a block, or kNoGaussian.
static inline std::uint32_t gaussian_in(const Block& block, std::uint64_t place) {
  const std::uint64_t bit = std::uint64_t{1} << place;
  if ((block.voxels & bit) == 0) return kNoGaussian;
  return block.first + static_cast<std::uint32_t>(__builtin_popcountll(block.voxels & (bit - 1)));
}

}  // namespace vantage::ndt
