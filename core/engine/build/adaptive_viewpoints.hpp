#pragma once

#include <cstdint>
#include <functional>
#include <limits>
#include <span>
#include <vector>

#include "vantage/point_cloud.hpp"
#include "vantage/result.hpp"

namespace vantage {

/// What some viewpoints see together, and how many viewpoints were not asked.
struct AdaptiveSight {
  IndexList seen;
  std::size_t skipped = 0;
};

/// Asks only as many viewpoints as show something new (`ViewpointParams::min_gain`). The plan is
/// cut into blocks of 8 voxels. In each block, one viewpoint is asked first, then those that bring
/// the spacing to 4, 2 and 1 voxels. This ends when a spacing shows no more than `min_gain` of what
/// it sees that no wider spacing showed, in any block. All heights and storeys of a place are asked
/// together. The answer depends neither on the number of threads nor on the order of the
/// viewpoints.
/// @param viewpoints  of one region, one place per voxel
/// @param points      above every index that is seen
/// @param seen_from   asks several viewpoints at once; is called from many threads at once
/// @param enough      the search ends after the first spacing by which more points than this are
///                    seen
/// Errors: the first error that `seen_from` returns at the widest spacing with an error.
[[nodiscard]] Result<AdaptiveSight> see_adaptively(
    std::span<const Point> viewpoints, double voxel_size, double min_gain, std::size_t points,
    const std::function<Result<IndexList>(std::span<const Point>)>& seen_from,
    std::uint64_t enough = std::numeric_limits<std::uint64_t>::max());

}  // namespace vantage
