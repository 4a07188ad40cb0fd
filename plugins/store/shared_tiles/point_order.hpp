#pragma once

#include <cstdint>
#include <unordered_map>
#include <vector>

#include "region_sequences.hpp"

namespace vantage::shared_tiles {

/// One order of all points in which every region's points ascend. A point's place in it is its
/// rank.
///
/// The order is a merge of the regions: a point is taken when every region that has it has come to
/// it. If regions contradict each other (one has a before b, the other b before a), a point is
/// taken once more for those regions that come to it later; it is then stored twice. The order
/// depends only on the regions, not on the numbers of the points.
class PointOrder {
 public:
  /// @param uses  how many regions have each point
  PointOrder(const RegionSequences& regions, const std::vector<std::uint32_t>& uses);

  /// The points' numbers, by rank.
  [[nodiscard]] const std::vector<std::uint32_t>& ids() const noexcept { return ids_; }
  /// The least rank of a point above `after`, the rank of the point before it in a region; -1 at
  /// the start. Precondition: the points are asked for in the order of a region.
  [[nodiscard]] std::uint32_t rank(std::uint32_t id, std::int64_t after) const noexcept;

 private:
  void take(std::uint32_t id);

  std::vector<std::uint32_t> ids_;
  std::vector<std::uint32_t> first_;                                     // rank, by number
  std::unordered_map<std::uint32_t, std::vector<std::uint32_t>> later_;  // further ranks, ascending
};

}  // namespace vantage::shared_tiles
