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
  Bounds3 map_bounds;  ///< box around the whole wide-area map, also where only P_ij is tested (D of
                       ///< Eq. 6)
  double max_range = std::numeric_limits<double>::infinity();  ///< reach of the sensor [m]
};

/// Who wants to know how far `visible_from_any` is.
class VANTAGE_API VisibilityProgress {
 public:
  virtual ~VisibilityProgress();

  /// May be called from several threads at once; must return soon and must not use TBB.
  /// @param viewpoints  how many more are done
  virtual void advanced(std::size_t viewpoints) const noexcept = 0;
};

/// How often points are seen.
struct ViewCounts {
  IndexList points;                  ///< those that are seen at all, strictly ascending
  std::vector<std::uint32_t> views;  ///< of each of them: from how many viewpoints, 1 or more
};

/// The points of one map, ready to be asked what can be seen from where.
/// Borrows the map, which must outlive it.
/// Thread safety: const methods may run on one object from many threads at once.
class VANTAGE_API VisibilityScene {
 public:
  virtual ~VisibilityScene();

  /// B_q of Eq. 9: what is seen from one viewpoint.
  /// @param viewpoint  map frame [m]; `invalid_input` if not finite
  /// @return           indices of the observable points, strictly ascending; only points at a
  ///                   distance in (0, max_range] count, the others neither are seen nor occlude
  [[nodiscard]] virtual Result<IndexList> visible(const Point& viewpoint) const noexcept = 0;

  /// V_ij of Eq. 10: what is seen from at least one viewpoint. The default joins `visible` of all,
  /// in parallel; an operator that can share work between viewpoints overrides it.
  /// @param progress  told of viewpoints while they are done, of all together at most once each and
  ///                  of none after the call; an operator may leave that out. No effect on the
  ///                  result; nullptr for nobody
  [[nodiscard]] virtual Result<IndexList> visible_from_any(
      std::span<const Point> viewpoints,
      const VisibilityProgress* progress = nullptr) const noexcept;

  /// From how many of the viewpoints each point is seen; a viewpoint that is listed twice counts
  /// twice. The default asks `visible` of all, in parallel, with 4 bytes a map point on top; an
  /// operator that can share work between viewpoints overrides it.
  /// @param progress  as for `visible_from_any`
  /// @return          `points` as `visible_from_any` gives them
  [[nodiscard]] virtual Result<ViewCounts> view_counts(
      std::span<const Point> viewpoints,
      const VisibilityProgress* progress = nullptr) const noexcept;

 protected:
  /// @param map_size  number of points of the map that the scene was prepared for
  explicit VisibilityScene(std::size_t map_size) noexcept : map_size_(map_size) {}

 private:
  std::size_t map_size_;
};

/// Decides which map points can be observed from a viewpoint (Sec. 2.3).
/// Thread safety: `prepare` may run on one object from many threads at once.
class VANTAGE_API VisibilityOperator {
 public:
  virtual ~VisibilityOperator();

  /// Builds once what every viewpoint needs.
  /// @param map  N points, map frame [m]; borrowed by the scene
  /// Errors: `invalid_input` for an empty map or a non-finite coordinate.
  [[nodiscard]] virtual Result<std::unique_ptr<VisibilityScene>> prepare(
      PointsView map, const VisibilityLimits& limits) const noexcept = 0;
};

}  // namespace vantage
