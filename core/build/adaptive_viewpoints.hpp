#pragma once

#include <cstdint>
#include <functional>
#include <limits>
#include <span>
#include <vector>

#include "vantage/point_cloud.hpp"
#include "vantage/result.hpp"

namespace vantage {

/// What the viewpoints see together, and how many of them `min_gain` left out.
struct AdaptiveSight {
  IndexList seen;
  std::size_t skipped = 0;
};

/// Evaluates only viewpoints that still show something new (`ViewpointParams::min_gain`). The plan
/// is cut into blocks of 8 x 8 voxels. In each block, one place is evaluated first, then the places
/// that bring the spacing to 4, 2 and 1 voxels. A block is finished when the share of new points
/// among those that a spacing sees in it is at most `min_gain`. A point is new if no wider spacing
/// saw it, in any block. All heights and storeys of a place are evaluated together. The answer
/// depends neither on the number of threads nor on the order of the viewpoints.
/// @param viewpoints  of one region, one place per voxel
/// @param points      larger than every index that is seen
/// @param seen_from   evaluates several viewpoints; is called from many threads at once
/// @param enough      evaluation ends once a spacing brings the seen points above this number
/// Errors: those of `seen_from`: of the widest spacing with an error, the error of the first block.
[[nodiscard]] Result<AdaptiveSight> see_adaptively(
    std::span<const Point> viewpoints, double voxel_size, double min_gain, std::size_t points,
    const std::function<Result<IndexList>(std::span<const Point>)>& seen_from,
    std::uint64_t enough = std::numeric_limits<std::uint64_t>::max());

}  // namespace vantage
