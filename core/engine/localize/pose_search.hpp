#pragma once

#include <cstddef>
#include <cstdint>
#include <limits>
#include <optional>
#include <vector>

#include "vantage/engine/region_maps.hpp"
#include "vantage/map_store.hpp"
#include "vantage/scan_matcher.hpp"

namespace vantage {

/// Where to search for a lost sensor, and how thoroughly.
struct SearchArea {
  Point centre = Point::Zero();                             ///< map frame [m]
  double radius = std::numeric_limits<double>::infinity();  ///< in plan view [m]
  double spacing = 2.0;                                     ///< of the places that are tried [m]
  double height = 0.0;        ///< of the sensor above the viewpoints [m]
  std::optional<Pose> guess;  ///< T_map_scan; tried with every heading, too
  std::uint32_t headings = 36;
  std::size_t scored_points = 120, aligned_points = 500;  ///< of the scan
  std::size_t starts = 150;                               ///< places that are aligned from
};

struct Hypothesis {
  RegionId region;
  Alignment alignment;
};

/// How strongly a scan supports a pose: how well its points match, and how many of them do.
[[nodiscard]] inline double evidence(const ScanScore& score) noexcept {
  return score.nvtl * score.coverage;
}

/// Finds poses from which a scan may have been taken. It tries places where a sensor can be (the
/// regions' viewpoints), upright, with headings all around. It scores some points of the scan
/// there, aligns more points from the best places, and aligns the whole scan from the best
/// of those.
/// Regions are searched one after the other. Besides the maps that `maps` holds, only the current
/// one is in memory. The answer does not depend on the number of threads.
/// @param scan  N points, sensor frame [m], evenly thinned
/// @return      at most five poses that differ from each other, those with the most evidence first
/// Errors: those of RegionMaps::borrow and of the matcher, except `too_few_matches`.
[[nodiscard]] Result<std::vector<Hypothesis>> search_pose(const MapIndex& index,
                                                          const RegionMaps& maps, PointsView scan,
                                                          const SearchArea& area);

}  // namespace vantage
