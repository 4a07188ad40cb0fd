#pragma once

#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

#include "vantage/point_cloud.hpp"

namespace vantage::view {

/// Points of several maps, each place once, and how many of the maps hold it or, where maps tell
/// how many viewpoints see a point, how many do from all maps together. A place is a cell of
/// `cell_size()`: 1 cm, or 2^-20 of the largest extent where that is more. A store may hand out one
/// map point a few micrometres apart from different maps; beside a cell's edge (one point in a
/// thousand) it then counts as two.
///
/// No more than `max_points` places are kept: those whose hashed cell is below a share, the largest
/// of 1, 3/4, (3/4)^2, ... that suffices. So a place is kept in all maps or in none, and which ones
/// are does not depend on the order of maps and points.
class PointTable {
 public:
  /// @param bounds  of all points [m]; those outside are kept like all others
  /// Precondition: max_points > 0.
  PointTable(const Bounds3& bounds, std::size_t max_points);

  /// Adds the points of one more map.
  /// @param views  of each point, or none; at one place the most count
  void add(PointsView map, std::span<const std::uint32_t> views = {});

  /// The first point of each place, in the order they came.
  [[nodiscard]] const PointCloud& points() const noexcept { return points_; }
  /// Of each of them: how many maps have a point in its cell, or the views there.
  [[nodiscard]] const std::vector<std::uint32_t>& views() const noexcept { return views_; }
  /// The same of the cell of `p`; 0 for a place that is not kept.
  [[nodiscard]] std::uint32_t views_at(const Point& p) const noexcept;
  [[nodiscard]] double cell_size() const noexcept { return cell_; }
  [[nodiscard]] bool thinned() const noexcept { return share_ < 1.0; }

 private:
  [[nodiscard]] std::uint64_t key_of(const Point& p) const noexcept;
  [[nodiscard]] bool kept(std::uint64_t key) const noexcept;
  void thin_out();
  /// The slot of a cell: the one that holds it, or the empty one where it belongs.
  [[nodiscard]] std::size_t slot_of(std::uint64_t key) const noexcept;
  /// Makes slots for twice as many points as there are, at least.
  void rebuild_slots();

  Point origin_;
  double cell_;
  std::size_t max_points_;
  double share_ = 1.0;
  // Open addressing, at most half full: 0, or the number of a cell's point counted from 1.
  std::vector<std::uint32_t> slots_;
  std::vector<std::uint64_t> keys_;  // of the points
  PointCloud points_;
  std::vector<std::uint32_t> views_, last_map_, views_of_last_;
  std::uint32_t map_ = 0;
};

}  // namespace vantage::view
