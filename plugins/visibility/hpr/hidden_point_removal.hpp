#pragma once

#include <memory>
#include <mutex>
#include <span>
#include <vector>

#include "point_octree.hpp"
#include "settings.hpp"
#include "sight.hpp"
#include "vantage/point_cloud.hpp"
#include "vantage/result.hpp"
#include "vantage/visibility.hpp"

namespace vantage::hpr {

/// The points of a map, ready to be asked which of them are seen from where: those whose turned
/// image p* (Eqs. 7-8, in double) is a vertex of the convex hull of all turned images and the
/// viewpoint, taken as exact numbers. Only points at a distance in (1e-30 m, max_range] take part.
/// So a point in a facet, on an edge or behind another one in the same direction is hidden, and
/// points at one place are all seen or all hidden; nothing depends on the order of the points, on
/// other viewpoints or on threads. If all that take part are at one place, they are seen.
///
/// Thread safety: const methods may run on one object from many threads at once.
class HiddenPointRemoval {
 public:
  /// @param map  1 to 2^32 - 2 finite points [m]; not kept
  HiddenPointRemoval(PointsView map, const Settings& settings);

  /// B_q of Eq. 9.
  /// @param viewpoint  finite [m]
  /// @return           strictly ascending indices; empty if no point takes part
  /// Errors: `invalid_input` where a point that takes part is farther than R (flip, at least two
  /// places).
  [[nodiscard]] Result<IndexList> visible(const Point& viewpoint) const;

  /// The union of `visible`, in parallel. Viewpoints share what they find: a point that one sees
  /// is not tested again, and what occludes from one is tried first from the next.
  /// @param progress  told of each viewpoint, at the end of those that are there more than once;
  ///                  nullptr for nobody
  /// Errors: that of the first viewpoint that has one.
  [[nodiscard]] Result<IndexList> visible_from_any(std::span<const Point> viewpoints,
                                                   const VisibilityProgress* progress) const;

 private:
  class LentSight;
  void forget_idle() const;
  [[nodiscard]] Result<void> check_radius(const Point& viewpoint) const;
  [[nodiscard]] IndexList map_indices(std::vector<PointOctree::Index> positions) const;

  PointOctree octree_;
  Settings settings_;

  // Of earlier calls of `visible_from_any`: at most one for each thread at a time.
  mutable std::mutex mutex_;  // guards both
  mutable std::vector<std::unique_ptr<Sight>> idle_;
  mutable std::size_t sights_ = 0;  // made so far
};

/// One viewpoint of one map.
[[nodiscard]] Result<IndexList> hidden_point_removal(PointsView map, const Point& viewpoint,
                                                     const Settings& settings);

}  // namespace vantage::hpr
