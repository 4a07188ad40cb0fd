#pragma once

#include <cstddef>
#include <vector>

namespace vantage::terrain {

/// Heights on a grid, row by row; +infinity where there is none [m].
struct Heights {
  std::size_t width = 0, height = 0;
  std::vector<double> z;
};

/// The morphological opening with a square of 2 radius + 1 cells: at each cell the highest of the
/// minima over all squares that hold the cell. Cells without a height, and everything beyond the
/// grid, do not count. Takes the same time for every radius (van Herk 1992, Gil and Werman 1993).
[[nodiscard]] Heights opening(const Heights& heights, std::size_t radius);

}  // namespace vantage::terrain
