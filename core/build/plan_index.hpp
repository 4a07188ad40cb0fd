#pragma once

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

#include "vantage/kit/index_set.hpp"
#include "vantage/point_cloud.hpp"

namespace vantage {

/// Indices by group, in their given order within each group: 4 bytes per index and per group.
struct Groups {
  std::vector<std::uint32_t> begin;  // of each group in `members`; then the end of the last group
  IndexList members;

  [[nodiscard]] std::span<const std::uint32_t> operator[](std::size_t group) const {
    return std::span(members).subspan(begin[group], begin[group + 1] - begin[group]);
  }
};

/// Sorts indices into groups.
/// @param index_of  returns the k-th of `count` indices
/// @param group_of  returns the group of an index, below `groups`
template <class IndexOf, class GroupOf>
[[nodiscard]] Groups grouped(std::size_t count, std::size_t groups, const IndexOf& index_of,
                             const GroupOf& group_of) {
  Groups result{std::vector<std::uint32_t>(groups + 2), IndexList(count)};
  // Counts are stored two places ahead. Placing the indices then moves each beginning into place.
  for (std::size_t k = 0; k < count; ++k) ++result.begin[group_of(index_of(k)) + 2];
  for (std::size_t g = 2; g < groups + 2; ++g) result.begin[g] += result.begin[g - 1];
  for (std::size_t k = 0; k < count; ++k) {
    const std::uint32_t index = index_of(k);
    result.members[result.begin[group_of(index) + 1]++] = index;
  }
  result.begin.pop_back();
  return result;
}

/// Finds the points in a small part of the plan without looking at the rest. Uses square buckets of
/// about a hundred points.
class PlanIndex {
 public:
  /// @param map       finite points
  /// @param index_of  returns the k-th of `count` indices into `map`, strictly ascending
  template <class IndexOf>
  PlanIndex(PointsView map, std::size_t count, const IndexOf& index_of) : limit_(map.size()) {
    Bounds3 bounds;
    for (std::size_t k = 0; k < count; ++k) bounds.extend(map[index_of(k)]);
    if (bounds.empty()) bounds = {Point::Zero(), Point::Zero()};
    min_ = bounds.min.head<2>();
    const Eigen::Vector2d size = bounds.max.head<2>() - min_;
    const double buckets = std::ceil(static_cast<double>(count) / 100.0);
    width_ =
        std::max({std::sqrt(size.x() * size.y() / buckets), size.maxCoeff() / kMostBuckets, 1e-6});
    columns_ = along(size.x(), kMostBuckets) + 1;
    rows_ = along(size.y(), kMostBuckets) + 1;
    groups_ = grouped(count, columns_ * rows_, index_of, [&](std::uint32_t index) {
      const Point& p = map[index];
      return along(p.y() - min_.y(), rows_) * columns_ + along(p.x() - min_.x(), columns_);
    });
  }

  /// All indices whose points lie in a box, and some others near it; strictly ascending.
  [[nodiscard]] IndexList near(const Eigen::Vector2d& min, const Eigen::Vector2d& max) const {
    const std::size_t x0 = along(min.x() - min_.x(), columns_);
    const std::size_t x1 = along(max.x() - min_.x(), columns_);
    const std::size_t y0 = along(min.y() - min_.y(), rows_);
    const std::size_t y1 = along(max.y() - min_.y(), rows_);
    const auto first_of_row = [&](std::size_t y) { return groups_.begin[y * columns_ + x0]; };
    const auto end_of_row = [&](std::size_t y) { return groups_.begin[y * columns_ + x1 + 1]; };
    std::size_t count = 0;
    for (std::size_t y = y0; y <= y1; ++y) count += end_of_row(y) - first_of_row(y);
    IndexList found;
    found.reserve(count);
    for (std::size_t y = y0; y <= y1; ++y) {
      found.insert(found.end(), groups_.members.begin() + first_of_row(y),
                   groups_.members.begin() + end_of_row(y));
    }
    if (found.size() > limit_ / 64) {  // here a walk over all bits is cheaper than sorting
      IndexSet set(limit_);
      set.add(found);
      return set.ascending();
    }
    std::sort(found.begin(), found.end());
    return found;
  }

 private:
  static constexpr std::size_t kMostBuckets = 4096;  // along one axis

  /// The bucket at an offset. It grows with the offset, so that a place between two others is in a
  /// bucket between theirs.
  [[nodiscard]] std::size_t along(double offset, std::size_t buckets) const noexcept {
    const double bucket = offset / width_;
    if (!(bucket > 0.0)) return 0;
    return static_cast<std::size_t>(std::min(bucket, static_cast<double>(buckets - 1)));
  }

  std::size_t limit_;  // larger than every index
  Eigen::Vector2d min_;
  double width_;
  std::size_t columns_, rows_;
  Groups groups_;
};

}  // namespace vantage
