#include "vantage/kit/max_views_of.hpp"

#include <algorithm>
#include <string>

namespace vantage {

Result<std::uint32_t> max_views_of(const RegionMap& map) {
  if (map.views.empty()) return 0;
  if (map.views.size() != map.points.size()) {
    return fail(ErrorCode::invalid_input, "the region map has " + std::to_string(map.views.size()) +
                                              " views for " + std::to_string(map.points.size()) +
                                              " points");
  }
  const auto [least, most] = std::minmax_element(map.views.begin(), map.views.end());
  if (*least > 0) return *most;
  return fail(ErrorCode::invalid_input, "a point of the region map is seen from 0 viewpoints");
}

}  // namespace vantage
