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
  std::vector<Find> finds;  ///< that differ from each other, those with the most evidence first
  std::size_t aligned = 0;  ///< places that were tried
};

/// The part of a scan that stands up: what find_places searches with. The ground matches at any
/// heading and says nothing. The whole scan if hardly anything stands up.
/// @param scan  sensor frame, z up [m]
[[nodiscard]] PointCloud upright_part(PointsView scan);

/// Finds poses from which a scan may have been taken: aligns it at the places that fit best (see
/// find_places). Only the regions of these places are loaded.
/// @param scan       N points, sensor frame [m], evenly thinned
/// @param to_itself  the scan's fit to itself, of the points `some`
/// Errors: those of RegionMaps::borrow and of the matcher, except `too_few_matches`.
[[nodiscard]] Result<Finds> search_pose(const MapIndex& index, const RegionMaps& maps,
                                        const PlaceIndex& places, PointsView scan, PointsView some,
                                        const Fit& to_itself, const PlaceArea& area);

}  // namespace vantage
