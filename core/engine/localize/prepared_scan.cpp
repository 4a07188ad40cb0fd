#include "vantage/engine/prepared_scan.hpp"

#include <limits>

#include "vantage/engine/viewpoints.hpp"

namespace vantage {

Result<PreparedScan> prepare_scan(PointsView points, const LocalizerParams& params) {
  PreparedScan prepared;
  const double max_range = params.scan_max_range.value_or(std::numeric_limits<double>::infinity());
  prepared.finite.reserve(points.size());
  for (const Point& p : points) {
    if (!p.allFinite()) {
      ++prepared.dropped;
      continue;
    }
    const double range = p.norm();
    if (range >= params.scan_min_range && range <= max_range) prepared.finite.push_back(p);
  }
  if (params.scan_voxel_size > 0.0) {
    VANTAGE_TRY(prepared.points, voxel_centroids(prepared.finite, params.scan_voxel_size));
  } else {
    prepared.points = prepared.finite;
  }
  return prepared;
}

}  // namespace vantage
