#pragma once

#include <cstddef>
#include <vector>

namespace vantage::terrain {

/// Heights on a grid, row by row; +infinity where there is no height [m].
struct Heights {
  std::size_t width = 0, height = 0;
  std::vector<double> z;
};

/// The morphological opening with a square of 2 radius + 1 cells. Each cell gets the highest of the
/// minima over all squares that contain the cell. Cells without a height, and everything outside
/// the grid, do not count. Takes the same time for every radius (van Herk 1992, Gil and Werman
/// 1993).
[[nodiscard]] Heights opening(const Heights& heights, std::size_t radius);

}  // namespace vantage::terrain
