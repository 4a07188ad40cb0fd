#pragma once

#include <functional>

#include "atlas/site_trials.hpp"
#include "build/condense.hpp"
#include "build/cut.hpp"
#include "build/sight.hpp"
#include "vantage/engine/build.hpp"
#include "vantage/map_store.hpp"

namespace vantage {

/// Evaluates, condenses and stores every region. Regions run in parallel and are stored in order.
/// A finished region waits for the store as indices; points are copied for one region at a time.
/// @param sight   its scene is released after the last region is evaluated
/// @param trials  run in every region's map; may be nullptr
/// @param report  holds the partition and the number of viewpoints
/// @return        the report with sizes and costs of the regions
/// Errors: the error of the first region that fails; it names the region's label.
[[nodiscard]] Result<BuildReport> build_regions(
    PointsView map, Sight& sight, const Cut& cut, const Condenser& condenser, MapStore& store,
    SiteTrials* trials, BuildReport report,
    const std::function<void(const BuildProgress&)>& progress);

}  // namespace vantage
