#pragma once

#include <optional>
#include <stop_token>

#include "localize/evidence.hpp"
#include "localize/place_index.hpp"
#include "localize/pose_search.hpp"
#include "vantage/engine/localizer_params.hpp"
#include "vantage/engine/plugin_loader.hpp"
#include "vantage/engine/prepared_scan.hpp"
#include "vantage/engine/region_maps.hpp"
#include "vantage/engine/regions_ahead.hpp"
#include "vantage/relocalizer.hpp"
#include "vantage/result.hpp"
#include "vantage/scan_matcher.hpp"

namespace vantage {

/// A scan whose pose is searched for. Borrows nothing, so that the search may outlive the scan.
struct SearchTask {
  PreparedScan scan;
  std::optional<Fit> to_itself;  ///< the scan's fit to itself, if it is known already
  PlaceArea area;
  std::optional<Eigen::Vector3d> up = {};  ///< in the sensor frame, if an accelerometer tells
};

struct SearchAnswer {
  bool searchable = true;  ///< false: the bundle holds nothing that can be searched
  bool compared = false;   ///< whether all places where the sensor may be were looked at
  Finds found = {};
  Fit to_itself = {};  ///< of the scan
};

/// Searches a bundle. It reads only what other threads may read at the same time.
/// Thread safety: one search at a time.
class Searcher {
 public:
  /// All of them must outlive the object.
  Searcher(const Bundle& bundle, const BundleRelocalizer& relocalizer,
           const PluginPtr<ScanMatcher>& matcher, const RegionsAhead& regions,
           const RegionMaps& maps, const LocalizerParams& params)
      : bundle_(bundle),
        relocalizer_(relocalizer),
        matcher_(matcher),
        regions_(regions),
        maps_(maps),
        params_(params) {}

  /// Opens the index of places at the first search.
  /// @param stop  ends the search early; the answer is then worthless
  /// Errors: those of the store, of the relocalizer and of the matcher.
  [[nodiscard]] Result<SearchAnswer> operator()(const SearchTask& task,
                                                const std::stop_token& stop);

 private:
  /// Whether there is an index of places. A bundle of an older version that holds prepared maps
  /// only has none: its maps can be tracked in, but not searched.
  [[nodiscard]] Result<bool> need_places();

  const Bundle& bundle_;
  const BundleRelocalizer& relocalizer_;
  const PluginPtr<ScanMatcher>& matcher_;
  const RegionsAhead& regions_;
  const RegionMaps& maps_;
  const LocalizerParams& params_;
  PluginPtr<RelocalizerIndex> places_;  // from the first search on
};

}  // namespace vantage
