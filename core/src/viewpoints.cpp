#include "vantage/viewpoints.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <unordered_map>

namespace vantage {
namespace {

struct VoxelKey {
  std::int64_t z, y, x;
  friend auto operator<=>(const VoxelKey&, const VoxelKey&) = default;
};

struct Hash {
  std::size_t operator()(const VoxelKey& key) const noexcept {
    std::uint64_t h = 0;
    for (const std::int64_t k : {key.z, key.y, key.x}) {
      h = (h ^ static_cast<std::uint64_t>(k)) * 0x9e3779b97f4a7c15U;
      h ^= h >> 32U;
    }
    return h;
  }
};

/// The points of one voxel. Offsets from its first point: no digits are lost far from the origin.
struct Voxel {
  VoxelKey key;
  Point first;
  Point sum_of_offsets = Point::Zero();
  std::uint64_t count = 0;

  [[nodiscard]] Point centroid() const {
    return first + sum_of_offsets / static_cast<double>(count);
  }
};

/// @param number_of  the number of the i-th point in `points`, in ascending order
template <class NumberOf>
Result<PointCloud> centroids(PointsView points, std::size_t count, const NumberOf& number_of,
                             double voxel_size) {
  if (!(voxel_size > 0.0) || !std::isfinite(voxel_size)) {
    return fail(ErrorCode::invalid_input,
                "voxel size must be positive, not " + std::to_string(voxel_size));
  }
  constexpr double kLimit = 0x1p50;
  std::vector<Voxel> voxels;
  std::unordered_map<VoxelKey, std::size_t, Hash> place_of;  // in `voxels`
  for (std::size_t i = 0; i < count; ++i) {
    const std::size_t k = number_of(i);
    const Point voxel = (points[k] / voxel_size).array().floor();
    if (!(voxel.cwiseAbs().maxCoeff() < kLimit)) {
      return fail(ErrorCode::invalid_input,
                  "point " + std::to_string(k) +
                      " is not finite or too far from the origin for voxels of " +
                      std::to_string(voxel_size) + " m");
    }
    const VoxelKey key{static_cast<std::int64_t>(voxel.z()), static_cast<std::int64_t>(voxel.y()),
                       static_cast<std::int64_t>(voxel.x())};
    const auto [place, is_new] = place_of.try_emplace(key, voxels.size());
    if (is_new) voxels.push_back({.key = key, .first = points[k]});
    Voxel& one = voxels[place->second];
    one.sum_of_offsets += points[k] - one.first;
    ++one.count;
  }
  std::sort(voxels.begin(), voxels.end(),
            [](const Voxel& a, const Voxel& b) { return a.key < b.key; });
  PointCloud result;
  result.reserve(voxels.size());
  for (const Voxel& voxel : voxels) result.push_back(voxel.centroid());
  return result;
}

Result<PointCloud> raised(Result<PointCloud> centroids, double height) {
  if (centroids) {
    for (Point& q : *centroids) q.z() += height;
  }
  return centroids;
}

}  // namespace

Result<PointCloud> voxel_centroids(PointsView points, double voxel_size) {
  return centroids(
      points, points.size(), [](std::size_t i) { return i; }, voxel_size);
}

Result<PointCloud> viewpoints_over(PointsView ground, const ViewpointParams& params) {
  return raised(voxel_centroids(ground, params.voxel_size), params.sensor_height);
}

Result<PointCloud> viewpoints_over(PointsView map, std::span<const std::uint32_t> ground,
                                   const ViewpointParams& params) {
  return raised(
      centroids(
          map, ground.size(), [&](std::size_t i) { return ground[i]; }, params.voxel_size),
      params.sensor_height);
}

}  // namespace vantage
