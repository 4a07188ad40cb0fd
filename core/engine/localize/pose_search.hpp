#pragma once

#include <cstdint>
#include <memory>
#include <vector>

#include "localize/evidence.hpp"
#include "vantage/engine/region_maps.hpp"
#include "vantage/engine/regions_ahead.hpp"
#include "vantage/pose.hpp"
#include "vantage/relocalizer.hpp"
#include "vantage/scan_matcher.hpp"

namespace vantage {

/// A pose from which a scan may have been taken.
struct Find {
  RegionId region;
  std::shared_ptr<const ReadyRegion> map;  ///< of the region
  Alignment alignment;
  double share;  ///< Evidence::share
};

/// How much there was to do; the same on any machine.
struct SearchWork {
  double search_ms = 0.0;     ///< PoseCandidates::nominal_ms
  std::uint64_t aligned = 0;  ///< points of the scan, in each alignment
  /// Points of the region maps, whether or not they were ready; none if there is only one region.
  std::uint64_t loaded = 0;
  [[nodiscard]] bool operator==(const SearchWork&) const = default;
};

/// Where a scan was aligned, and how well it fits there.
struct Tried {
  Pose T_map_scan;
  double share;  ///< Evidence::share
};

struct Finds {
  /// No two of them are the same pose; the greatest share comes first.
  std::vector<Find> finds = {};
  std::vector<Tried> tried = {};  ///< all places; no two of them are the same pose
  SearchWork work = {};

  /// What a pose was chosen from: the places that were tried, with the mean share of those that are
  /// not at the pose.
  [[nodiscard]] Lookalikes around(const Pose& T_map_scan, const ShareModel& model) const;
};

/// The parts of a bundle that a search reads.
struct SearchedBundle {
  const RegionsAhead& regions;
  const RegionMaps& maps;
  const RelocalizerIndex& places;
};

/// Finds poses from which a scan may have been taken. It aligns the scan at the candidates of the
/// relocalizer, and loads only the regions of these places.
/// @param scan       N points, sensor frame [m], evenly thinned
/// @param some       the points that are scored, sensor frame [m]
/// @param to_itself  the fit of the points `some` to their own scan
/// Errors: those of the relocalizer, of RegionMaps::borrow and of the matcher, except
/// `too_few_matches`; `internal` for a relocalizer that breaks its contract.
[[nodiscard]] Result<Finds> search_pose(const SearchedBundle& bundle, PointsView scan,
                                        PointsView some, const Fit& to_itself,
                                        const PlaceQuery& query);

/// Aligns a later scan at the poses that were found for an earlier one.
/// @param T_then_now  how the sensor moved in between
/// @param some        points of the scan that are scored
/// @param to_itself   the fit to itself of the earlier scan, or of the later one
/// Errors: those of the matcher, except `too_few_matches`.
[[nodiscard]] Result<std::vector<Find>> align_again(const std::vector<Find>& finds,
                                                    const Pose& T_then_now, PointsView scan,
                                                    PointsView some, const Fit& to_itself);

}  // namespace vantage
