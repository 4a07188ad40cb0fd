#pragma once

#include <cstdint>
#include <functional>

#include "build/blocks.hpp"
#include "build/condense.hpp"
#include "build/plan.hpp"
#include "build/progress.hpp"
#include "build/sight.hpp"
#include "vantage/build/build.hpp"
#include "vantage/result.hpp"

namespace vantage {

/// Receives the regions of a block in their order, from one thread at a time. The points of a
/// region are those of the part that the block was built from.
using TakeRegion = std::function<Result<void>(std::uint32_t region, BuiltRegion built)>;

/// Evaluates and condenses the regions of a block (Sec. 2.3), and hands them on. Regions run in
/// parallel and are handed on in order. A finished region waits as indices.
/// @param sight      over what decides about the block; its scene is released after the last region
///                   is evaluated
/// @param condenser  over the same points
/// @param meter      of the whole build; it learns of each region that is handed on
/// Errors: that of the first region that fails, which names the region's label.
[[nodiscard]] Result<void> build_block(const RegionBlock& block, const BuildPlan& plan,
                                       VisibilityScope scope, Sight& sight,
                                       const Condenser& condenser, Meter& meter,
                                       const TakeRegion& take);

}  // namespace vantage
