#pragma once

#include <algorithm>
#include <cstdint>
#include <span>
#include <vector>

#include "vantage/point_cloud.hpp"

namespace vantage {

/// Which points of a map lie together: those of one cell of a cubic grid, with the tightest box
/// around them. Four bytes a point, and as many again while the grid is made; a box each cell.
class PointGrid {
 public:
  struct Cell {
    Bounds3 bounds;                    ///< the tightest around its points
    std::uint32_t begin = 0, end = 0;  ///< of `indices`
  };

  /// @param map    finite points [m], fewer than 2^32
  /// @param width  edge of a cell [m], at least 1 so that no quotient overflows; infinite for
  ///               one cell
  PointGrid(PointsView map, double width);

  /// In the order of their first points.
  [[nodiscard]] std::span<const Cell> cells() const noexcept { return cells_; }

  /// Which points of the map a cell holds, ascending.
  [[nodiscard]] std::span<const std::uint32_t> indices(const Cell& cell) const noexcept {
    return std::span(indices_).subspan(cell.begin, cell.end - cell.begin);
  }

  /// Calls `use` with the index of each point in cells that come within `range` of a place.
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
