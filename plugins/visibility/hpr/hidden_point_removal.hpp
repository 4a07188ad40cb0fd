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

/// The points of a map, prepared for queries of which points are seen from where. A point is seen
/// if its turned image p* (Eqs. 7-8, in double) is a vertex of the convex hull of all turned images
/// and the viewpoint, taken as exact numbers. Only points at a distance in (1e-30 m, max_range]
/// take part. So a point in a facet, on an edge, or behind another point in the same direction is
/// hidden, and points at one place are either all seen or all hidden. Nothing depends on the order
/// of the points, on other viewpoints or on threads. If all points that take part are at one place,
/// they are seen.
///
/// Thread safety: const methods may run on one object from many threads at once.
class HiddenPointRemoval {
 public:
  /// @param map  1 to 2^32 - 2 finite points [m]; not kept
  HiddenPointRemoval(PointsView map, const Settings& settings);

  /// B_q of Eq. 9.
  /// @param viewpoint  finite [m]
  /// @return           strictly ascending indices; empty if no point takes part
  /// Errors: `invalid_input` if a point that takes part is farther away than R (for the flip, if
  /// there are at least two places).
  [[nodiscard]] Result<IndexList> visible(const Point& viewpoint) const;

  /// The union of `visible`, in parallel. Viewpoints share their results: a point that one
  /// viewpoint sees is not tested again, and what occludes from one viewpoint is tried first at the
  /// next.
  /// @param progress  receives each viewpoint once it is done; viewpoints that occur more than once
  ///                  are reported at the end; nullptr if no reports are wanted
  /// Errors: the error of the first viewpoint that has one.
  [[nodiscard]] Result<IndexList> visible_from_any(std::span<const Point> viewpoints,
                                                   const VisibilityProgress* progress) const;

 private:
  class LentSight;
  void forget_idle() const;
  [[nodiscard]] Result<void> check_radius(const Point& viewpoint) const;
  [[nodiscard]] IndexList map_indices(std::vector<PointOctree::Index> positions) const;

  PointOctree octree_;
  Settings settings_;

  // Kept from earlier calls of `visible_from_any`: at most one per thread at a time.
  mutable std::mutex mutex_;  // guards both
  mutable std::vector<std::unique_ptr<Sight>> idle_;
  mutable std::size_t sights_ = 0;  // made so far
};

/// The answer for one viewpoint of one map.
[[nodiscard]] Result<IndexList> hidden_point_removal(PointsView map, const Point& viewpoint,
                                                     const Settings& settings);

}  // namespace vantage::hpr
