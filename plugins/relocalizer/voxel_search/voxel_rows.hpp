#pragma once

#include <algorithm>
#include <array>
#include <bit>
#include <cstddef>
#include <cstdint>
#include <vector>

#include "vantage/kit/bit_coder.hpp"

namespace vantage::voxel_search {

/// Codes the voxels of a strip, which is 64 voxels wide along x: row by row along y, layer by layer
/// upwards. The chance of a voxel depends on the voxels beside and below that are already coded.
/// @tparam Coder  BitEncoder or BitDecoder
template <class Coder>
class VoxelRows {
 public:
  /// @param coder  borrowed
  /// @param rows   of each layer
  VoxelRows(Coder& coder, int rows)
      : coder_(coder), here_(std::size_t(rows) + 2), below_(here_), deeper_(here_) {}

  void begin_strip() {
    for (auto* const layer : {&here_, &below_, &deeper_}) std::ranges::fill(*layer, 0);
  }
  void begin_layer() {
    deeper_.swap(below_);
    below_.swap(here_);
    std::ranges::fill(here_, 0);
  }
  /// @param y      rows are coded in ascending order
  /// @param width  voxels of the row, 1 to 64
  /// @param row    one bit each, those from `width` on clear; a decoder ignores it
  /// @return       the row that is coded
  std::uint64_t code(int y, int width, std::uint64_t row) {
    const std::size_t at = std::size_t(y) + 1;
    const std::uint64_t before = here_[at - 1], below = below_[at];
    const std::uint64_t below_before = below_[at - 1], below_after = below_[at + 1];
    Chance& any = any_[std::size_t(before != 0) | std::size_t(below != 0) << 1U |
                       std::size_t(below_after != 0) << 2U];
    if (!coder_.code(any, row != 0)) return 0;
    std::uint64_t coded = 0;
    std::uint64_t last = 0;
    for (int x = 0; x < width; ++x) {
      // Three neighbours at once. At the ends of a row, the third is that of the other end.
      const std::uint64_t seen = last | (std::rotr(before, x - 1) & 7U) << 1U |
                                 (std::rotr(below, x - 1) & 7U) << 4U |
                                 (below_before >> x & 1U) << 7U | (below_after >> x & 1U) << 8U |
                                 (deeper_[at] >> x & 1U) << 9U;
      last = coder_.code(voxel_[seen], (row >> x & 1U) != 0) ? 1 : 0;
      coded |= last << x;
    }
    return here_[at] = coded;
  }

 private:
  Coder& coder_;
  std::vector<std::uint64_t> here_, below_, deeper_;  // layers; the row y is at y + 1
  std::array<Chance, 8> any_;
  std::array<Chance, 1024> voxel_;
};

}  // namespace vantage::voxel_search
