#include "vantage/point_cloud.hpp"

#include <algorithm>

namespace vantage {

Bounds3 bounds_of(PointsView points) noexcept {
  Bounds3 bounds;
  for (const Point& p : points) bounds.extend(p);
  return bounds;
}

bool all_finite(PointsView points) noexcept {
  return std::all_of(points.begin(), points.end(), [](const Point& p) { return p.allFinite(); });
}

PointCloud select(PointsView points, std::span<const std::uint32_t> indices) {
  PointCloud selected;
  selected.reserve(indices.size());
  for (const std::uint32_t i : indices) selected.push_back(points[i]);
  return selected;
}

}  // namespace vantage
