#include "common/bundle_format.hpp"

#include <algorithm>
#include <limits>

#include "vantage/kit/max_views_of.hpp"
#include "vantage/kit/numbers.hpp"

namespace vantage::bundle_folder {
namespace {

/// The largest distance of a point from an origin along an axis [m].
double reach_of(PointsView points, const Point& origin) {
  if (points.empty()) return 0.0;
  const Bounds3 bounds = bounds_of(points);
  return std::max((bounds.max - origin).maxCoeff(), (origin - bounds.min).maxCoeff());
}

/// Errors: `invalid_input` for what float32 cannot hold.
Result<Point> origin_of(const RegionMap& map) {
  if (!all_finite(map.points)) {
    return fail(ErrorCode::invalid_input, "a point of the region map is not finite");
  }
  if (!all_finite(map.viewpoints)) {
    return fail(ErrorCode::invalid_input, "a viewpoint of the region map is not finite");
  }
  const PointsView centred = map.points.empty() ? map.viewpoints : map.points;
  if (centred.empty()) return Point(Point::Zero());
  const Bounds3 bounds = bounds_of(centred);
  // Whole metres: every compiler computes the same origin, and its text is short.
  const Point origin = (0.5 * bounds.min + 0.5 * bounds.max).array().round() + 0.0;
  const double reach = std::max(reach_of(map.points, origin), reach_of(map.viewpoints, origin));
  if (!(reach <= static_cast<double>(std::numeric_limits<float>::max()))) {
    return fail(ErrorCode::invalid_input, "the region map is too large for float32: it reaches " +
                                              shortest(reach) + " m from its centre");
  }
  return origin;
}

}  // namespace

Result<RegionFile> checked(const RegionMap& map) {
  if (map.prepared.bytes.empty() && map.prepared.elements > 0) {
    return fail(ErrorCode::invalid_input, "the prepared map has elements, but no bytes");
  }
  RegionFile file{.points = map.points.size(),
                  .viewpoints = map.viewpoints.size(),
                  .elements = map.prepared.elements,
                  .prepared_bytes = map.prepared.bytes.size()};
  VANTAGE_TRY(file.max_views, max_views_of(map));
  VANTAGE_TRY(file.origin, origin_of(map));
  return file;
}

}  // namespace vantage::bundle_folder
