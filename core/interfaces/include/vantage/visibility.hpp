#pragma once

#include <cstddef>
#include <cstdint>
#include <limits>
#include <memory>
#include <span>
#include <vector>

#include "vantage/api.hpp"
#include "vantage/point_cloud.hpp"
#include "vantage/result.hpp"

namespace vantage {

/// What a visibility operator must know beyond the points it tests.
struct VisibilityLimits {
  Bounds3 map_bounds;  ///< box around the whole wide-area map, even if only P_ij is tested (D of
                       ///< Eq. 6)
  double max_range = std::numeric_limits<double>::infinity();  ///< reach of the sensor [m]
};

/// Receives progress reports of `visible_from_any` and `view_counts`.
class VANTAGE_API VisibilityProgress {
 public:
  virtual ~VisibilityProgress();

  /// May be called from several threads at once. It must return soon and must not use TBB.
  /// @param viewpoints  number of further viewpoints that are done
  virtual void advanced(std::size_t viewpoints) const noexcept = 0;
};

/// The points that are seen, and how many viewpoints see each.
struct ViewCounts {
  IndexList points;                  ///< seen by at least one viewpoint, strictly ascending
  std::vector<std::uint32_t> views;  ///< number of viewpoints that see each: 1 or more
};

/// The points of one map, prepared for visibility queries.
/// Borrows the map; the map must outlive the scene.
/// Thread safety: const methods may run on one object from many threads at once.
class VANTAGE_API VisibilityScene {
 public:
  virtual ~VisibilityScene();

  /// B_q of Eq. 9: the points seen from one viewpoint.
  /// @param viewpoint  map frame [m]; `invalid_input` if not finite
  /// @return           indices of the observable points, strictly ascending. Points at a distance
  ///                   outside (0, max_range] are not seen and do not occlude
  [[nodiscard]] virtual Result<IndexList> visible(const Point& viewpoint) const noexcept = 0;

  /// V_ij of Eq. 10: the points seen from at least one viewpoint. SceneByViewpoint of the kit joins
  /// the results of `visible`.
  /// @param progress  receives reports, only during the call; nullptr if none are wanted. Each
  ///                  viewpoint is reported at most once; an operator may report none. Does not
  ///                  change the result
  [[nodiscard]] virtual Result<IndexList> visible_from_any(
      std::span<const Point> viewpoints,
      const VisibilityProgress* progress = nullptr) const noexcept = 0;

  /// How many of the viewpoints see each point. A viewpoint that is listed twice counts twice.
  /// SceneByViewpoint of the kit counts the results of `visible`.
  /// @param progress  as for `visible_from_any`
  /// @return          counts for the same points that `visible_from_any` returns
  [[nodiscard]] virtual Result<ViewCounts> view_counts(
      std::span<const Point> viewpoints,
      const VisibilityProgress* progress = nullptr) const noexcept = 0;
};

/// Decides which map points can be observed from a viewpoint (Sec. 2.3).
/// Thread safety: `prepare` may run on one object from many threads at once.
class VANTAGE_API VisibilityOperator {
 public:
  virtual ~VisibilityOperator();

  /// Does the work that is common to all viewpoints.
  /// @param map  N points, map frame [m]; borrowed by the scene
  /// Errors: `invalid_input` for an empty map or a non-finite coordinate.
  [[nodiscard]] virtual Result<std::unique_ptr<VisibilityScene>> prepare(
      PointsView map, const VisibilityLimits& limits) const noexcept = 0;

  /// How far from a viewpoint, in plan view, points may lie that are seen from it or decide about
  /// those [m]. A build from tiles prepares a part of the map with this margin around the
  /// viewpoints, in the order of the whole map, and expects the answers that the whole map gives.
  /// Infinite (the default): the operator needs the whole map at once.
  [[nodiscard]] virtual double reach(const VisibilityLimits& limits) const noexcept;
};

}  // namespace vantage
