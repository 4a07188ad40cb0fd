#pragma once

#include <cstdint>
#include <functional>

#include "build/blocks.hpp"
#include "build/condense.hpp"
#include "build/plan.hpp"
#include "build/progress.hpp"
#include "build/sight.hpp"
#include "vantage/engine/build.hpp"
#include "vantage/map_parts.hpp"
#include "vantage/result.hpp"

namespace vantage {

/// Receives the regions of a block in their order, from one thread at a time. The points of a
/// region are those of the part that the block was built from.
using TakeRegion = std::function<Result<void>(std::uint32_t region, BuiltRegion built)>;

/// Evaluates and condenses the regions of a block (Sec. 2.3), and hands them on. Regions run in
/// parallel and are handed on in order. A finished region waits as indices.
/// @param map    what decides about the block
/// @param sight  over `map`; its scene is released after the last region is evaluated
/// @param meter  of the whole build; it learns of each region that is handed on
/// @return       processor time of choosing elements [s]
/// Errors: that of the first region that fails, which names the region's label; those of
/// Condenser::over.
[[nodiscard]] Result<double> build_block(const RegionBlock& block, PointsView map, Sight& sight,
                                         const BuildPlan& plan, const BuildPlugins& plugins,
                                         const BuildParams& params, Meter& meter,
                                         const TakeRegion& take);

}  // namespace vantage
