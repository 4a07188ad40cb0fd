#include "common/extent.hpp"

#include <algorithm>
#include <string>
#include <vector>

#include "vantage/kit/numbers.hpp"

namespace vantage::matching {

Error too_wide(PointsView map, double edge) {
  Point middle;
  std::vector<double> sorted(map.size());
  for (const Eigen::Index axis : {0, 1, 2}) {
    std::ranges::transform(map, sorted.begin(), [&](const Point& p) { return p[axis]; });
    const auto median = sorted.begin() + static_cast<std::ptrdiff_t>(sorted.size() / 2);
    std::ranges::nth_element(sorted, median);
    middle[axis] = *median;
  }
  const auto away = [&](const Point& p) { return (p - middle).lpNorm<Eigen::Infinity>(); };
  const auto farthest = std::ranges::max_element(map, {}, away);
  return {.code = ErrorCode::invalid_input,
          .message = "the map spans more than two million voxels of " + shortest(edge) +
                     " m: its farthest point is number " + std::to_string(farthest - map.begin()) +
                     ", at (" + shortest(farthest->x()) + ", " + shortest(farthest->y()) + ", " +
                     shortest(farthest->z()) + ") m",
          .where = {},
          .context = {}};
}

}  // namespace vantage::matching
