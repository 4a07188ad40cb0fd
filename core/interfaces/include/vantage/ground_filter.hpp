#pragma once

#include "vantage/api.hpp"
#include "vantage/point_cloud.hpp"
#include "vantage/result.hpp"

namespace vantage {

/// Finds the ground in a point cloud (Sec. 2.2).
/// Thread safety: `ground` may run on one object from many threads at once.
/// Errors: `invalid_input` for an empty cloud or a non-finite coordinate.
class VANTAGE_API GroundFilter {
 public:
  virtual ~GroundFilter();

  /// @param cloud  N points, map frame, z up [m]; borrowed for this call only
  /// @return       indices of the ground points of `cloud`, strictly ascending; may be empty
  [[nodiscard]] virtual Result<IndexList> ground(PointsView cloud) const noexcept = 0;

  /// How far away, in plan view, points may lie that decide whether a point is ground [m]. A build
  /// from tiles gives the filter a part of the map and this margin around it, and expects the
  /// answer that the whole map gives. Infinite (the default): the filter needs the whole map at
  /// once.
  [[nodiscard]] virtual double reach() const noexcept;
};

}  // namespace vantage
