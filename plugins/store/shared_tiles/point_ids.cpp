#include "point_ids.hpp"

#include <algorithm>
#include <bit>

#include "vantage/kit/hash.hpp"

namespace vantage::shared_tiles {
namespace {

constexpr std::uint64_t kMostReserved = 1ULL << 27U;  // [points]; beyond, vectors grow as they do
constexpr std::uint32_t kNoRegion = 0xffff'ffff;

std::uint64_t hash_of(const Point& p) noexcept {
  return hash(0, std::bit_cast<std::uint64_t>(p.x()), std::bit_cast<std::uint64_t>(p.y()),
              std::bit_cast<std::uint64_t>(p.z()));
}

}  // namespace

PointIds::PointIds(std::uint64_t expected) : slots_(1024, kNone) {
  if (expected > kMostReserved) return;
  points_.reserve(expected);
  uses_.reserve(expected);
  last_region_.reserve(expected);
  follower_.reserve(expected);
}

Result<std::vector<std::uint32_t>> PointIds::of(PointsView region_points, std::uint32_t region) {
  if (points_.size() + region_points.size() >= kNone) {
    return fail(ErrorCode::invalid_input, "the regions have more than 2^32 - 2 points");
  }
  std::vector<std::uint32_t> ids;
  ids.reserve(region_points.size());
  std::uint32_t before = kNone;
  for (const Point& given : region_points) {
    const Point p = given.array() + 0.0;  // -0 is 0
    // Most points come after the same one as in the region before: that saves a search.
    std::uint32_t id = before == kNone ? kNone : follower_[before];
    if (id == kNone || points_[id] != p || last_region_[id] == region) id = find_or_add(p);
    const std::uint32_t first = id;
    while (last_region_[id] == region) {
      const auto twin = twins_.find(id);
      const std::uint32_t next = twin != twins_.end() ? twin->second : add(p);
      if (twin == twins_.end()) twins_.emplace(id, next);
      id = next;
    }
    last_region_[id] = region;
    ++uses_[id];
    if (before != kNone) follower_[before] = first;
    before = id;
    ids.push_back(id);
  }
  return ids;
}

void PointIds::finish() {
  last_region_ = {};
  follower_ = {};
  slots_ = {};
  twins_ = {};
}

std::uint32_t PointIds::find_or_add(const Point& p) {
  if (4 * (points_.size() + 1) > 3 * slots_.size()) grow();
  const std::size_t mask = slots_.size() - 1;
  std::size_t at = hash_of(p) & mask;
  for (; slots_[at] != kNone; at = (at + 1) & mask) {
    if (points_[slots_[at]] == p) return slots_[at];
  }
  return slots_[at] = add(p);
}

std::uint32_t PointIds::add(const Point& p) {
  const auto id = static_cast<std::uint32_t>(points_.size());
  points_.push_back(p);
  uses_.push_back(0);
  last_region_.push_back(kNoRegion);
  follower_.push_back(kNone);
  return id;
}

/// Twins are found through the first of them: they have no slot.
void PointIds::grow() {
  std::vector<std::uint32_t> old(2 * slots_.size(), kNone);
  old.swap(slots_);
  const std::size_t mask = slots_.size() - 1;
  for (const std::uint32_t id : old) {
    if (id == kNone) continue;
    std::size_t at = hash_of(points_[id]) & mask;
    while (slots_[at] != kNone) at = (at + 1) & mask;
    slots_[at] = id;
  }
}

}  // namespace vantage::shared_tiles
