#pragma once

#include <algorithm>
#include <cstddef>

#include "vantage/point_cloud.hpp"

namespace vantage {

/// At most so many points, evenly picked.
[[nodiscard]] inline PointCloud evenly_picked(PointsView points, std::size_t most) {
  PointCloud some;
  const std::size_t n = std::min(most, points.size());
  some.reserve(n);
  for (std::size_t k = 0; k < n; ++k) some.push_back(points[k * points.size() / n]);
  return some;
}

}  // namespace vantage
