#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <vector>

#include "star_hull.hpp"

namespace vantage::hpr {

/// How far a hull reaches in the directions of a grid, at several resolutions, found out where it
/// is asked for. The hull may grow in between: what was found stays a lower bound.
class ReachGrid {
 public:
  ReachGrid();

  /// Forgets everything.
  void clear() { ++stamp_; }

  /// Whether all points of a cone are inside the hull: false also where the grid is too coarse to
  /// tell.
  [[nodiscard]] bool surely_holds(const StarHull::Cone& cone, StarHull& hull);

 private:
  struct Corner {
    double reach;
    std::uint32_t stamp;
  };
  static constexpr int kCoarsest = 4, kFinest = 8;  // 2^k x 2^k bins a face of the cube

  [[nodiscard]] double reach_at(int level, int face, int column, int row, StarHull& hull);

  std::vector<Corner> corners_[kFinest - kCoarsest + 1];
  std::uint32_t stamp_ = 1;
};

}  // namespace vantage::hpr
