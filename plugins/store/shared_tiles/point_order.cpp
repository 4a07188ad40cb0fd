#include "point_order.hpp"

#include <algorithm>
#include <utility>

namespace vantage::shared_tiles {
namespace {

constexpr std::uint32_t kNobody = 0xffff'ffff;

/// Regions that stand at points, and wait there for the others that have the same point.
class WaitingRegions {
 public:
  WaitingRegions(const RegionSequences& regions, const std::vector<std::uint32_t>& uses)
      : missing_(uses), last_(uses.size(), kNobody), next_(regions.regions(), kNobody) {
    cursors_.reserve(regions.regions());
    for (std::uint32_t r = 0; r < regions.regions(); ++r) cursors_.push_back(regions.of(r));
    for (std::uint32_t r = 0; r < regions.regions(); ++r) wait(r);
  }

  /// The next point that all have come to; if there is none, the regions contradict each other.
  /// kNobody when all have ended.
  [[nodiscard]] std::uint32_t pop() {
    if (ready_.empty()) return least_awaited();
    const std::uint32_t id = ready_.back();
    ready_.pop_back();
    return id;
  }
  /// The regions that wait at a point go on.
  void advance(std::uint32_t id) {
    std::uint32_t r = std::exchange(last_[id], kNobody);
    while (r != kNobody) {
      const std::uint32_t next = std::exchange(next_[r], kNobody);
      cursors_[r].next();
      wait(r);
      r = next;
    }
  }

 private:
  /// The point to take when no region can go on. In an order that most regions agree on, those that
  /// are missing at the first of all waiting points have it far ahead, if they have it in another
  /// place; those that are missing at the others will come to them soon.
  [[nodiscard]] std::uint32_t least_awaited() {
    constexpr std::uint32_t kMostRegions = 1024;  // that are asked
    constexpr int kSoon = 64;                     // [points]
    while (first_ < cursors_.size() && cursors_[first_].at_end()) ++first_;
    std::unordered_map<std::uint32_t, std::uint32_t> soon;  // how many come soon, by point
    const auto asked = static_cast<std::uint32_t>(
        std::min<std::size_t>(cursors_.size(), std::size_t{first_} + kMostRegions));
    for (std::uint32_t r = first_; r < asked; ++r) {
      RegionSequences::Cursor ahead = cursors_[r];
      for (int i = 0; i < kSoon && !ahead.at_end(); ++i) {
        ahead.next();
        if (!ahead.at_end() && last_[ahead.id()] != kNobody) ++soon[ahead.id()];
      }
    }
    std::uint32_t best = kNobody;
    std::pair<std::uint32_t, std::uint32_t> least;
    for (std::uint32_t r = first_; r < asked; ++r) {
      if (cursors_[r].at_end()) continue;
      const std::uint32_t id = cursors_[r].id();
      const auto found = soon.find(id);
      const std::pair awaited(found == soon.end() ? 0U : found->second, missing_[id]);
      if (best == kNobody || awaited < least) {
        best = id;
        least = awaited;
      }
    }
    return best;
  }
  void wait(std::uint32_t r) {
    if (cursors_[r].at_end()) return;
    const std::uint32_t id = cursors_[r].id();
    next_[r] = std::exchange(last_[id], r);
    if (--missing_[id] == 0) ready_.push_back(id);
  }

  std::vector<std::uint32_t> missing_;  // how many regions have yet to come, by point
  std::vector<std::uint32_t> last_;     // region that came to a point, by point
  std::vector<std::uint32_t> next_;     // that waits at the same point, by region
  std::vector<RegionSequences::Cursor> cursors_;
  std::vector<std::uint32_t> ready_;
  std::uint32_t first_ = 0;  // region that may not have ended
};

}  // namespace

PointOrder::PointOrder(const RegionSequences& regions, const std::vector<std::uint32_t>& uses)
    : first_(uses.size(), kNobody) {
  ids_.reserve(uses.size());
  WaitingRegions waiting(regions, uses);
  for (std::uint32_t id = waiting.pop(); id != kNobody; id = waiting.pop()) {
    take(id);
    waiting.advance(id);
  }
}

void PointOrder::take(std::uint32_t id) {
  const auto rank = static_cast<std::uint32_t>(ids_.size());
  if (first_[id] == kNobody) {
    first_[id] = rank;
  } else {
    later_[id].push_back(rank);
  }
  ids_.push_back(id);
}

std::uint32_t PointOrder::rank(std::uint32_t id, std::int64_t after) const noexcept {
  if (static_cast<std::int64_t>(first_[id]) > after) return first_[id];
  const std::vector<std::uint32_t>& ranks = later_.find(id)->second;
  return *std::upper_bound(ranks.begin(), ranks.end(), after);
}

}  // namespace vantage::shared_tiles
