#pragma once

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <functional>
#include <span>
#include <unordered_map>
#include <vector>

#include "vantage/point_cloud.hpp"

namespace vantage::range_image {

/// Groups the points of a map by the cells of a cubic grid, to skip points that are out of range.
/// Needs four bytes per point, and twice that while the groups are made.
class PointCells {
 public:
  struct Cell {
    Bounds3 bounds;                    ///< the tightest box around its points
    std::uint32_t begin = 0, end = 0;  ///< of `indices`
  };

  /// @param map    finite points [m]
  /// @param width  edge of a cell [m], at least 1, so that no quotient overflows; infinite for one
  PointCells(PointsView map, double width) : indices_(map.size()) {
    std::unordered_map<Key, std::uint32_t, KeyHash> number_of;
    std::vector<std::uint32_t> cell_of(map.size());
    for (std::size_t i = 0; i < map.size(); ++i) {
      const Key key = key_of(map[i], width);
      const auto next = static_cast<std::uint32_t>(cells_.size());
      cell_of[i] = number_of.try_emplace(key, next).first->second;
      if (cell_of[i] == next) cells_.emplace_back();
      Cell& cell = cells_[cell_of[i]];
      cell.bounds.extend(map[i]);
      ++cell.end;  // a count until all points are counted
    }
    std::uint32_t begin = 0;
    for (Cell& cell : cells_) {
      const std::uint32_t size = cell.end;
      cell.begin = cell.end = begin;
      begin += size;
    }
    for (std::uint32_t i = 0; i < map.size(); ++i) indices_[cells_[cell_of[i]].end++] = i;
  }

  /// Calls `use` with the index of each point in cells that come within `range` of a viewpoint.
  template <class Use>
  void for_each_near(const Point& viewpoint, double range, const Use& use) const {
    for (const Cell& cell : cells_) {
      const Point gap = (cell.bounds.min - viewpoint)
                            .cwiseMax(viewpoint - cell.bounds.max)
                            .cwiseMax(Point::Zero());
      if (gap.norm() > range) continue;
      std::for_each(indices_.begin() + cell.begin, indices_.begin() + cell.end, use);
    }
  }

 private:
  using Key = std::array<double, 3>;  // whole numbers, perhaps too large for any integer type

  struct KeyHash {
    std::size_t operator()(const Key& key) const noexcept {
      std::size_t hash = 0;
      for (const double x : key) hash = 31 * hash + std::hash<double>{}(x);
      return hash;
    }
  };

  [[nodiscard]] static Key key_of(const Point& p, double width) noexcept {
    return {std::floor(p.x() / width), std::floor(p.y() / width), std::floor(p.z() / width)};
  }

  std::vector<Cell> cells_;
  std::vector<std::uint32_t> indices_;
};

}  // namespace vantage::range_image
