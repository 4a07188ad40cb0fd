#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "atlas/virtual_lidar.hpp"
#include "vantage/engine/build.hpp"
#include "vantage/point_cloud.hpp"
#include "vantage/prepared_map.hpp"
#include "vantage/result.hpp"
#include "vantage/scan_matcher.hpp"

namespace vantage {

/// Chooses which elements of a region's prepared map are kept: looks at them with virtual scans
/// from some of the region's viewpoints, asks the selector for an order, and keeps as many as the
/// budget allows.
/// @param whole       the whole map, prepared
/// @param seen        the region's observable points, map frame [m]
/// @param viewpoints  of the region, map frame [m]; none: nothing can be chosen by
/// Errors: those of the selector and of MatchTarget; `internal` for a selector that breaks its
/// contract.
[[nodiscard]] Result<PreparedMap> select_elements(const MatchTarget& whole,
                                                  const Selector& selector,
                                                  const SelectionBudget& budget, PointsView seen,
                                                  std::span<const Point> viewpoints,
                                                  const HitsAt& hits_at);

}  // namespace vantage
