#pragma once

#include <cstdint>
#include <functional>

#include "common/minimum_raster.hpp"

namespace vantage::terrain {

/// How a ground filter works on a map of any extent.
struct Tiling {
  double cell_size;      ///< [m]
  LargestWindow window;  ///< of the filter
  std::int64_t reach;    ///< [cells] how far from a point something may be that decides about it
};

using Found = std::function<void(std::uint32_t)>;

/// The ground of a cloud, tile by tile in parallel: everything a filter does has a finite reach, so
/// a tile and what is around it give the same answer as the whole map, in memory that the map's
/// extent does not matter to.
/// @param find_ground  calls its second argument for the members of a raster that are ground
/// @return             their indices, strictly ascending
/// Errors: `invalid_input` for an empty or non-finite cloud, coordinates beyond 2^52 cells, or
/// windows that need too large a raster.
[[nodiscard]] Result<IndexList> ground_by_tiles(
    PointsView cloud, const Tiling& tiling,
    const std::function<void(MinimumRaster&, const Found&)>& find_ground);

}  // namespace vantage::terrain
