#pragma once

#include <vector>

#include "localize/evidence.hpp"
#include "places/place_search.hpp"
#include "vantage/engine/region_maps.hpp"
#include "vantage/map_store.hpp"
#include "vantage/scan_matcher.hpp"

namespace vantage {

/// A pose from which a scan may have been taken.
struct Find {
  RegionId region;
  Alignment alignment;
  Evidence evidence;
};

struct Finds {
  std::vector<Find> finds;  ///< no two of them are the same pose; the best evidence comes first
  std::size_t aligned = 0;  ///< number of places where the scan was aligned
};

/// Finds poses from which a scan may have been taken. It aligns the scan at the places that fit
/// best (see find_places), and loads only the regions of these places.
/// @param scan       N points, sensor frame [m], evenly thinned
/// @param some       the points that are scored, sensor frame [m]
/// @param to_itself  the fit of the points `some` to their own scan
/// Errors: those of RegionMaps::borrow and of the matcher, except `too_few_matches`.
[[nodiscard]] Result<Finds> search_pose(const MapIndex& index, const RegionMaps& maps,
                                        const PlaceIndex& places, PointsView scan, PointsView some,
                                        const Fit& to_itself, const PlaceArea& area);

}  // namespace vantage
