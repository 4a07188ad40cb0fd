#pragma once

#include <algorithm>
#include <cstdint>
#include <span>
#include <vector>

#include "vantage/point_cloud.hpp"

namespace vantage {

/// The points of a map, grouped by the cells of a cubic grid. Needs 4 bytes per point (8 while the
/// grid is made) and one box per cell.
class PointGrid {
 public:
  struct Cell {
    Bounds3 bounds;                    ///< the tightest box around its points
    std::uint32_t begin = 0, end = 0;  ///< of its points in the grid's order
  };

  /// @param map    finite points [m], fewer than 2^32
  /// @param width  edge of a cell [m], at least 1 so that no quotient overflows; infinite for
  ///               one cell
  PointGrid(PointsView map, double width);

  /// The occupied cells, in the order of their first points.
  [[nodiscard]] std::span<const Cell> cells() const noexcept { return cells_; }

  /// Indices of the map points in a cell, ascending.
  [[nodiscard]] std::span<const std::uint32_t> indices(const Cell& cell) const noexcept {
    return std::span(indices_).subspan(cell.begin, cell.end - cell.begin);
  }

  /// Calls `use` with the index of each point in cells with a box within `range` [m] of `place`.
  template <class Use>
  void for_each_near(const Point& place, double range, const Use& use) const {
    for (const Cell& cell : cells_) {
      const Point gap =
          (cell.bounds.min - place).cwiseMax(place - cell.bounds.max).cwiseMax(Point::Zero());
      if (gap.norm() > range) continue;
      std::for_each(indices_.begin() + cell.begin, indices_.begin() + cell.end, use);
    }
  }

 private:
  std::vector<Cell> cells_;
  std::vector<std::uint32_t> indices_;
};

}  // namespace vantage
