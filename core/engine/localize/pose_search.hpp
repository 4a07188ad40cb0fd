#pragma once

#include <cstdint>
#include <memory>
#include <optional>
#include <stop_token>
#include <string>
#include <vector>

#include "localize/evidence.hpp"
#include "localize/place_index.hpp"
#include "vantage/engine/bundle.hpp"
#include "vantage/engine/localizer_params.hpp"
#include "vantage/engine/plugin_loader.hpp"
#include "vantage/engine/prepared_scan.hpp"
#include "vantage/engine/region_maps.hpp"
#include "vantage/engine/regions_ahead.hpp"
#include "vantage/pose.hpp"
#include "vantage/relocalizer.hpp"
#include "vantage/result.hpp"
#include "vantage/scan_matcher.hpp"

namespace vantage {

/// A pose from which a scan may have been taken.
struct Find {
  RegionId region;
  std::shared_ptr<const ReadyRegion> map;  ///< of the region
  Alignment alignment;
  double share = 0.0;  ///< Evidence::share
};

/// How much there was to do; the same on any machine.
struct SearchWork {
  double search_ms = 0.0;     ///< PoseCandidates::nominal_ms
  std::uint64_t aligned = 0;  ///< points of the scan, in each alignment
  /// Points of the region maps, whether or not they were ready; none if there is only one region.
  std::uint64_t loaded = 0;
};

/// Where a scan was aligned, and how well it fits there.
struct Tried {
  Pose T_map_scan;
  double share;  ///< Evidence::share
};

/// A scan whose pose is searched for. Borrows nothing, so that the search may outlive the scan.
struct SearchTask {
  PreparedScan scan;             ///< without times
  std::optional<Fit> to_itself;  ///< the scan's fit to itself; none: `scan.finite` tells
  PlaceArea area;
  std::optional<Eigen::Vector3d> up = {};  ///< in the sensor frame, if an accelerometer tells
};

struct SearchAnswer {
  bool searchable = true;  ///< false: the bundle holds nothing that can be searched
  bool compared = false;   ///< whether all places where the sensor may be were looked at
  /// No two of them are the same pose; the greatest share comes first.
  std::vector<Find> finds = {};
  std::vector<Tried> tried = {};  ///< all places; no two of them are the same pose
  SearchWork work = {};
  Fit to_itself = {};        ///< of the scan
  std::string failure = {};  ///< of the first region whose map could not be used; empty: of none

  /// What a pose was chosen from: the places that were tried, with the mean share of those that are
  /// not at the pose.
  [[nodiscard]] Lookalikes around(const Pose& T_map_scan) const;
};

/// Finds poses from which a scan may have been taken. It aligns the scan at the candidates of the
/// relocalizer, and loads only the regions of these places. It reads only what other threads may
/// read at the same time.
/// Thread safety: one search at a time.
struct Searcher {
  // All of them must outlive the object.
  const Bundle& bundle;
  const BundleRelocalizer& relocalizer;
  const PluginPtr<ScanMatcher>& matcher;
  const RegionsAhead& regions;
  const RegionMaps& maps;
  const LocalizerParams& params;
  PluginPtr<RelocalizerIndex> places = {};  // from the first search on

  /// Opens the index of places at the first search.
  /// @param stop  ends the search early; the answer is then worthless
  /// Errors: those of the store, of the relocalizer, of RegionMaps::borrow and of the matcher,
  /// except `too_few_matches`; `internal` for a relocalizer that breaks its contract.
  [[nodiscard]] Result<SearchAnswer> operator()(const SearchTask& task,
                                                const std::stop_token& stop);
};

/// The answer for a later scan, which is aligned at the poses that were found for the earlier one.
/// @param T_then_now  how the sensor moved in between
/// Errors: those of the matcher, except `too_few_matches`.
[[nodiscard]] Result<SearchAnswer> align_again(SearchAnswer answer, const Pose& T_then_now,
                                               const PreparedScan& scan);

}  // namespace vantage
