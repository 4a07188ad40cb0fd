#pragma once

#include <cstdint>
#include <functional>
#include <span>
#include <vector>

#include "build/condense.hpp"
#include "build/plan_index.hpp"
#include "build/progress.hpp"
#include "build/sight.hpp"
#include "vantage/partition.hpp"

namespace vantage {

/// What a build works on: all regions, or a block of them.
struct RegionsToBuild {
  std::span<const std::uint32_t> which;       ///< ascending
  const std::vector<PointCloud>& viewpoints;  ///< by RegionId, of all regions
  const Groups& inside;  ///< P_ij by place in `which`, only for VisibilityScope::region
};

/// Receives regions in the order of `which`, from one thread at a time.
using TakeRegion = std::function<Result<void>(std::uint32_t region, Condensed condensed)>;

/// Evaluates and condenses regions, and hands them on. Regions run in parallel and are handed on in
/// order. A finished region waits as indices.
/// @param sight   its scene is released after the last region is evaluated
/// @param meter   of the whole build; it learns of each region that is handed on
/// Errors: the error of the first region that fails; it names the region's label.
[[nodiscard]] Result<void> build_regions(const RegionsToBuild& regions, const Partition& partition,
                                         Sight& sight, const Condenser& condenser, Meter& meter,
                                         const TakeRegion& take);

}  // namespace vantage
