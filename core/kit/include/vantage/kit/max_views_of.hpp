#pragma once

#include <cstdint>

#include "vantage/map_store.hpp"
#include "vantage/result.hpp"

namespace vantage {

/// The largest of a map's view counts; 0 if it has none.
/// Errors: `invalid_input` if there is not one count per point, or if a count is 0.
[[nodiscard]] Result<std::uint32_t> max_views_of(const RegionMap& map);

}  // namespace vantage
