#include "view/thinning.hpp"

#include <algorithm>
#include <cmath>

#include "vantage/kit/hash.hpp"

namespace vantage::view {
namespace {

constexpr double kFinestCell = 0.01;  // [m]
constexpr int kBits = 21;             // of a coordinate in a key
constexpr double kNextShare = 0.75;

}  // namespace

PointTable::PointTable(const Bounds3& bounds, std::size_t max_points)
    : origin_(bounds.empty() ? Point::Zero() : bounds.min), max_points_(max_points) {
  const double extent = bounds.empty() ? 0.0 : (bounds.max - bounds.min).maxCoeff();
  cell_ = std::max(kFinestCell, std::ldexp(extent, -(kBits - 1)));
}

std::uint64_t PointTable::key_of(const Point& p) const noexcept {
  std::uint64_t key = 0;
  for (int axis = 0; axis < 3; ++axis) {
    const double last = std::ldexp(1.0, kBits) - 1.0;
    const double cell = std::clamp(std::round((p[axis] - origin_[axis]) / cell_), 0.0, last);
    key = key << kBits | static_cast<std::uint64_t>(cell);
  }
  return key;
}

bool PointTable::kept(std::uint64_t key) const noexcept {
  return share_ >= 1.0 || std::ldexp(static_cast<double>(scatter(key)), -64) < share_;
}

void PointTable::add(PointsView map, std::span<const std::uint32_t> views) {
  ++map_;
  const auto hash_of = [&](std::uint32_t at) { return scatter(keys_[at]); };
  for (std::size_t i = 0; i < map.size(); ++i) {
    const Point& p = map[i];
    const std::uint32_t seen = views.empty() ? 1 : views[i];
    const std::uint64_t key = key_of(p);
    if (!kept(key)) continue;
    const std::uint32_t at = numbers_.insert(
        scatter(key), [&](std::uint32_t n) { return keys_[n] == key; }, hash_of);
    if (at == keys_.size()) {
      points_.push_back(p);
      keys_.push_back(key);
      views_.push_back(seen);
      last_map_.push_back(map_);
      views_of_last_.push_back(seen);
    } else {
      if (last_map_[at] != map_) views_of_last_[at] = 0;
      last_map_[at] = map_;
      if (seen > views_of_last_[at]) {
        views_[at] += seen - views_of_last_[at];
        views_of_last_[at] = seen;
      }
    }
    if (points_.size() > max_points_) thin_out();
  }
}

void PointTable::thin_out() {
  while (points_.size() > max_points_) {
    share_ *= kNextShare;
    std::size_t to = 0;
    for (std::size_t from = 0; from < points_.size(); ++from) {
      if (!kept(keys_[from])) continue;
      points_[to] = points_[from];
      keys_[to] = keys_[from];
      views_[to] = views_[from];
      last_map_[to] = last_map_[from];
      views_of_last_[to] = views_of_last_[from];
      ++to;
    }
    points_.resize(to);
    keys_.resize(to);
    views_.resize(to);
    last_map_.resize(to);
    views_of_last_.resize(to);
  }
  numbers_.renumber(static_cast<std::uint32_t>(keys_.size()),
                    [&](std::uint32_t at) { return scatter(keys_[at]); });
}

std::uint32_t PointTable::views_at(const Point& p) const noexcept {
  const std::uint64_t key = key_of(p);
  const std::uint32_t at =
      numbers_.find(scatter(key), [&](std::uint32_t n) { return keys_[n] == key; });
  return at == NumberTable::kNone ? 0 : views_[at];
}

}  // namespace vantage::view
