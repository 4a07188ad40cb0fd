#include "build/plugin_checks.hpp"

#include <algorithm>
#include <cstdint>
#include <string>

namespace vantage {

Result<void> check_indices(const IndexList& indices, std::size_t size, const char* who) {
  for (std::size_t i = 0; i < indices.size(); ++i) {
    if (indices[i] >= size || (i > 0 && indices[i] <= indices[i - 1])) {
      return fail(ErrorCode::internal, std::string("the ") + who +
                                           " plugin broke its contract: its indices must ascend "
                                           "strictly and stay below " +
                                           std::to_string(size));
    }
  }
  return {};
}

Result<void> check_views(const ViewCounts& counts, std::size_t viewpoints) {
  if (counts.views.size() == counts.points.size() &&
      std::all_of(counts.views.begin(), counts.views.end(),
                  [&](std::uint32_t views) { return views > 0 && views <= viewpoints; })) {
    return {};
  }
  return fail(ErrorCode::internal,
              "the visibility plugin broke its contract: every point that is seen has from 1 to " +
                  std::to_string(viewpoints) + " views");
}

}  // namespace vantage
