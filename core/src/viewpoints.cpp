#include "vantage/viewpoints.hpp"

#include <algorithm>
#include <cmath>

namespace vantage {
namespace {

struct VoxelKey {
  std::int64_t z, y, x;
  friend auto operator<=>(const VoxelKey&, const VoxelKey&) = default;
};

struct KeyedPoint {
  VoxelKey key;
  std::uint32_t index;
};

}  // namespace

Result<PointCloud> voxel_centroids(PointsView points, double voxel_size) {
  if (!(voxel_size > 0.0) || !std::isfinite(voxel_size)) {
    return fail(ErrorCode::invalid_input,
                "voxel size must be positive, not " + std::to_string(voxel_size));
  }
  constexpr double kLimit = 0x1p50;
  std::vector<KeyedPoint> keyed;
  keyed.reserve(points.size());
  for (std::size_t i = 0; i < points.size(); ++i) {
    const Point voxel = (points[i] / voxel_size).array().floor();
    if (!(voxel.cwiseAbs().maxCoeff() < kLimit)) {
      return fail(ErrorCode::invalid_input,
                  "point " + std::to_string(i) +
                      " is not finite or too far from the origin for voxels of " +
                      std::to_string(voxel_size) + " m");
    }
    keyed.push_back({{static_cast<std::int64_t>(voxel.z()), static_cast<std::int64_t>(voxel.y()),
                      static_cast<std::int64_t>(voxel.x())},
                     static_cast<std::uint32_t>(i)});
  }
  std::sort(keyed.begin(), keyed.end(), [](const KeyedPoint& a, const KeyedPoint& b) {
    return std::pair{a.key, a.index} < std::pair{b.key, b.index};
  });

  PointCloud centroids;
  for (std::size_t begin = 0; begin < keyed.size();) {
    // Sum of offsets from the voxel's first point: no digits are lost far from the origin.
    const Point& first = points[keyed[begin].index];
    Point sum = Point::Zero();
    std::size_t end = begin;
    for (; end < keyed.size() && keyed[end].key == keyed[begin].key; ++end) {
      sum += points[keyed[end].index] - first;
    }
    centroids.push_back(first + sum / static_cast<double>(end - begin));
    begin = end;
  }
  return centroids;
}

Result<PointCloud> viewpoints_over(PointsView ground, const ViewpointParams& params) {
  VANTAGE_TRY(PointCloud viewpoints, voxel_centroids(ground, params.voxel_size));
  for (Point& q : viewpoints) q.z() += params.sensor_height;
  return viewpoints;
}

}  // namespace vantage
