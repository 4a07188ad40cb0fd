#pragma once

#include <limits>
#include <optional>
#include <vector>

#include "vantage/engine/region_maps.hpp"
#include "vantage/map_store.hpp"
#include "vantage/scan_matcher.hpp"

namespace vantage {

/// Where to look for a sensor that is lost.
struct SearchArea {
  Point centre = Point::Zero();                             ///< map frame [m]
  double radius = std::numeric_limits<double>::infinity();  ///< in plan [m]
  double spacing = 2.0;                                     ///< of the places that are tried [m]
  double height = 0.0;        ///< of the sensor above the viewpoints [m]
  std::optional<Pose> guess;  ///< T_map_scan; tried with every heading, too
};

struct Hypothesis {
  RegionId region;
  Alignment alignment;
};

/// How much a scan speaks for a pose: matched well, and much of it.
[[nodiscard]] inline double evidence(const ScanScore& score) noexcept {
  return score.nvtl * score.coverage;
}

/// Finds poses that a scan may have been taken from: tries places where a sensor can be (the
/// regions' viewpoints) with headings all around, upright, scores a hundred points of the scan
/// there, aligns a few hundred from the best places and the whole scan from the best of those.
/// Regions are looked at one after the other; none but this one is in memory beside what `maps`
/// holds. The answer does not depend on the number of threads.
/// @param scan  N points, sensor frame [m], evenly thinned
/// @return at most five, different from each other, those with the most evidence first
/// Errors: those of RegionMaps::borrow and of the matcher, but `too_few_matches`.
[[nodiscard]] Result<std::vector<Hypothesis>> search_pose(const MapIndex& index,
                                                          const RegionMaps& maps, PointsView scan,
                                                          const SearchArea& area);

}  // namespace vantage
