#pragma once

#include <cstdint>

#include "vantage/point_cloud.hpp"

namespace vantage::init {

/// How many cells of a matcher a map fills.
struct CellCount {
  std::uint64_t cells = 0;  ///< with at least six points, as `ndt` wants them
  double area = 0.0;        ///< of the squares of the ground plan that hold any point [m^2]
};

/// @param map         N points [m]; finite
/// @param resolution  edge of a cell [m], > 0
[[nodiscard]] CellCount count_cells(PointsView map, double resolution);

}  // namespace vantage::init
