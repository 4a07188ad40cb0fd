#pragma once

#include <cstdint>
#include <functional>

#include "common/minimum_raster.hpp"

namespace vantage::terrain {

/// What a ground filter needs to work on a map of any extent.
struct Tiling {
  double cell_size;      ///< [m]
  LargestWindow window;  ///< of the filter
  std::int64_t reach;    ///< [cells] what decides about a point is at most this far away
};

/// GroundFilter::reach: also the cell that a point shares with others, and the rounding of cells.
[[nodiscard]] inline double metres_of(std::int64_t reach, double cell_size) noexcept {
  return static_cast<double>(reach + 2) * cell_size;
}

using Found = std::function<void(std::uint32_t)>;

/// Finds the ground of a cloud, tile by tile and in parallel. Everything that a filter does has a
/// finite reach, so a tile and its surroundings give the same answer as the whole map. The memory
/// needed does not depend on the map's extent.
/// @param find_ground  calls its second argument for those members of a raster that are ground
/// @return             indices of the ground points, strictly ascending
/// Errors: `invalid_input` for an empty or non-finite cloud, for coordinates beyond 2^52 cells, or
/// for windows that need a raster that is too large.
[[nodiscard]] Result<IndexList> ground_by_tiles(
    PointsView cloud, const Tiling& tiling,
    const std::function<void(MinimumRaster&, const Found&)>& find_ground);

}  // namespace vantage::terrain
