#pragma once

#include <cstdint>
#include <functional>
#include <limits>
#include <span>
#include <vector>

#include "vantage/point_cloud.hpp"
#include "vantage/result.hpp"

namespace vantage {

/// What some viewpoints see together, and how many of them were not asked.
struct AdaptiveSight {
  IndexList seen;
  std::size_t skipped = 0;
};

/// Sees from as many viewpoints as show something new (`ViewpointParams::min_gain`). The plan is
/// cut into blocks of 8 voxels. In each, one viewpoint is asked, then those that bring the spacing
/// to 4, 2 and 1 voxels, until a spacing shows no more than `min_gain` of what it sees that no
/// wider spacing showed, in any block. All heights and storeys of a place are asked together. The
/// answer does not depend on the number of threads or the order of the viewpoints.
/// @param viewpoints  of one region, one place a voxel
/// @param points      above every index that is seen
/// @param seen_from   asks some of them at once; from many threads at once
/// @param enough      ends after the first spacing by which more than this are seen
/// Errors: the first that `seen_from` has at the widest spacing that has one.
[[nodiscard]] Result<AdaptiveSight> see_adaptively(
    std::span<const Point> viewpoints, double voxel_size, double min_gain, std::size_t points,
    const std::function<Result<IndexList>(std::span<const Point>)>& seen_from,
    std::uint64_t enough = std::numeric_limits<std::uint64_t>::max());

}  // namespace vantage
