#pragma once

#include <cstddef>
#include <cstdint>
#include <memory>
#include <span>
#include <vector>

#include "build/selection.hpp"
#include "build/sight.hpp"
#include "vantage/build/build.hpp"
#include "vantage/map_store.hpp"
#include "vantage/point_cloud.hpp"
#include "vantage/result.hpp"

namespace vantage {

/// A region on its way to a store, its points by their indices.
struct BuiltRegion {
  std::uint64_t seen = 0;     ///< points that at least one viewpoint sees
  std::uint64_t skipped = 0;  ///< viewpoints that were not evaluated
  std::uint64_t points = 0;   ///< after thinning, whether they are stored or not
  ViewCounts stored = {};     ///< map points; empty if only the prepared map is stored
  IndexList observable = {};  ///< map points before thinning, until the matcher has got them
  PreparedMap prepared = {};  ///< no bytes if none is stored, or if no element is seen
  std::vector<PredictedError> errors = {};  ///< if a selector has chosen its elements
};

/// Copies the points that the indices name.
/// @param map  of the indices
[[nodiscard]] RegionMap region_map_of(PointsView map, BuiltRegion region, PointCloud viewpoints);

/// Turns observable maps into what is stored: thins them, and lets the matcher prepare them.
/// Thread safety: const methods may run on one object from many threads at once.
class Condenser {
 public:
  /// What a map means that is too sparse for the matcher to make an element of it. A part of a map
  /// may be so: its regions store no prepared maps.
  enum class Sparse : bool { refuse, accept };

  /// All arguments are borrowed. Without a point nothing is seen, and the matcher is not asked.
  /// Errors: those of ScanMatcher::prepare, without `too_few_matches` for Sparse::accept;
  /// `unsupported` for a matcher that cannot store its maps: the build fails here, before hours of
  /// visibility.
  [[nodiscard]] static Result<Condenser> over(PointsView map, const BuildPlugins& plugins,
                                              const BuildParams& params, Sparse sparse);

  /// Thins the points, and chooses the elements of the prepared map that are kept.
  /// @param viewpoints  of the region, map frame [m]
  [[nodiscard]] Result<BuiltRegion> thin(Observable observable,
                                         std::span<const Point> viewpoints) const;

  /// Processor time of choosing elements so far [s].
  [[nodiscard]] double core_seconds_selection() const noexcept {
    return selection_ ? selection_->core_seconds() : 0.0;
  }

  /// Has the matcher prepare the region, and leaves out what is not stored.
  [[nodiscard]] Result<BuiltRegion> finish(BuiltRegion region) const;

 private:
  Condenser(PointsView map, const BuildParams& params) : map_(map), params_(params) {}

  PointsView map_;
  const BuildParams& params_;
  PluginPtr<MatchTarget> whole_;  // the map; none if only points are stored, or if it is sparse
  std::unique_ptr<Selection> selection_;  // none: prepared maps keep all elements
};

}  // namespace vantage
