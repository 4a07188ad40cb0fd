#pragma once

#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

#include "vantage/kit/number_table.hpp"
#include "vantage/point_cloud.hpp"

namespace vantage::view {

/// Points of several maps, each place once, with a count. The count is the number of maps that
/// contain the place; if maps say how many viewpoints see a point, it is the number of viewpoints
/// over all maps. A place is a cell of `cell_size()`: 1 cm, or 2^-20 of the largest extent if that
/// is more. A store may return one map point a few micrometres apart from different maps. Beside a
/// cell's edge (one point in a thousand), such a point counts as two.
///
/// At most `max_points` places are kept: those whose hashed cell is below a share, the largest of
/// 1, 3/4, (3/4)^2, ... that suffices. So a place is kept in all maps or in none, and the choice
/// does not depend on the order of maps and points.
class PointTable {
 public:
  /// @param bounds  of all points [m]; points outside are kept like all others
  /// Precondition: max_points > 0.
  PointTable(const Bounds3& bounds, std::size_t max_points);

  /// Adds the points of one more map.
  /// @param views  one count per point, or none; at each place, the largest count is used
  void add(PointsView map, std::span<const std::uint32_t> views = {});

  /// The first point of each place, in the order of arrival.
  [[nodiscard]] const PointCloud& points() const noexcept { return points_; }
  /// For each of these points, how many maps have a point in its cell, or the view count there.
  [[nodiscard]] const std::vector<std::uint32_t>& views() const noexcept { return views_; }
  /// The same count for the cell of `p`; 0 for a place that is not kept.
  [[nodiscard]] std::uint32_t views_at(const Point& p) const noexcept;
  [[nodiscard]] double cell_size() const noexcept { return cell_; }
  [[nodiscard]] bool thinned() const noexcept { return share_ < 1.0; }

 private:
  [[nodiscard]] std::uint64_t key_of(const Point& p) const noexcept;
  [[nodiscard]] bool kept(std::uint64_t key) const noexcept;
  void thin_out();

  Point origin_;
  double cell_;
  std::size_t max_points_;
  double share_ = 1.0;
  NumberTable numbers_;              // of the cells: those of their points
  std::vector<std::uint64_t> keys_;  // of the points
  PointCloud points_;
  std::vector<std::uint32_t> views_, last_map_, views_of_last_;
  std::uint32_t map_ = 0;
};

}  // namespace vantage::view
