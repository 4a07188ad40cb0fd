#include "vantage/point_cloud.hpp"

#include <algorithm>
#include <cstdint>
#include <limits>
#include <string>

namespace vantage {

Bounds3 bounds_of(PointsView points) noexcept {
  Bounds3 bounds;
  for (const Point& p : points) bounds.extend(p);
  return bounds;
}

bool all_finite(PointsView points) noexcept {
  return std::all_of(points.begin(), points.end(), [](const Point& p) { return p.allFinite(); });
}

Result<void> check_points(PointsView points, std::string_view what) {
  if (points.empty()) return fail(ErrorCode::invalid_input, std::string(what) + " has no points");
  constexpr std::uint32_t kLimit = std::numeric_limits<std::uint32_t>::max();
  if (points.size() >= kLimit) {
    return fail(ErrorCode::invalid_input,
                std::string(what) + " has " + std::to_string(points.size()) +
                    " points, more than the " + std::to_string(kLimit) + " that can be indexed");
  }
  const auto bad =
      std::find_if(points.begin(), points.end(), [](const Point& p) { return !p.allFinite(); });
  if (bad == points.end()) return {};
  return fail(ErrorCode::invalid_input, std::string(what) +
                                            " has a point that is not finite (point " +
                                            std::to_string(bad - points.begin()) + " of " +
                                            std::to_string(points.size()) + ", counted from 0)");
}

PointCloud select(PointsView points, std::span<const std::uint32_t> indices) {
  PointCloud selected;
  selected.reserve(indices.size());
  for (const std::uint32_t i : indices) selected.push_back(points[i]);
  return selected;
}

}  // namespace vantage
