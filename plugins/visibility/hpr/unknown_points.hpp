#pragma once

#include <atomic>
#include <bit>
#include <cstddef>
#include <cstdint>
#include <vector>

#include "point_octree.hpp"

namespace vantage::hpr {

/// The points that no viewpoint is known to see so far. Threads may query and mark at the same
/// time: a thread that takes a seen point as unknown only tests it once more.
class UnknownPoints {
 public:
  using Index = PointOctree::Index;

  explicit UnknownPoints(const PointOctree& octree)
      : octree_(octree), left_in_(octree.nodes().size()), seen_(octree.points().size() / 64 + 1) {
    for (std::size_t k = 0; k < left_in_.size(); ++k) {
      left_in_[k].store(octree.nodes()[k].size(), std::memory_order_relaxed);
    }
  }

  [[nodiscard]] bool any_in(Index node) const {
    return left_in_[node].load(std::memory_order_relaxed) != 0;
  }
  [[nodiscard]] std::size_t left() const { return left_in_[0].load(std::memory_order_relaxed); }
  [[nodiscard]] bool holds(Index position) const {
    return (seen_[position / 64].load(std::memory_order_relaxed) >> (position % 64) & 1U) == 0;
  }
  /// Returns whether the point was unknown.
  bool mark_seen(Index position, Index leaf) {
    const std::uint64_t bit = std::uint64_t{1} << (position % 64);
    if ((seen_[position / 64].fetch_or(bit, std::memory_order_relaxed) & bit) != 0) return false;
    for (Index node = leaf; node != PointOctree::kNone; node = octree_.nodes()[node].parent) {
      left_in_[node].fetch_sub(1, std::memory_order_relaxed);
    }
    return true;
  }

  /// Positions, ascending.
  [[nodiscard]] std::vector<Index> seen() const {
    std::vector<Index> positions;
    positions.reserve(octree_.points().size() - left());
    for (std::size_t word = 0; word < seen_.size(); ++word) {
      for (std::uint64_t bits = seen_[word].load(std::memory_order_relaxed); bits != 0;
           bits &= bits - 1) {
        positions.push_back(
            static_cast<Index>(64 * word + static_cast<unsigned>(std::countr_zero(bits))));
      }
    }
    return positions;
  }

 private:
  const PointOctree& octree_;
  std::vector<std::atomic<Index>> left_in_;       // of each node
  std::vector<std::atomic<std::uint64_t>> seen_;  // a bit for each position
};

}  // namespace vantage::hpr
