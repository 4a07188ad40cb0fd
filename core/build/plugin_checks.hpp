#pragma once

#include <cstddef>

#include "vantage/point_cloud.hpp"
#include "vantage/result.hpp"
#include "vantage/visibility.hpp"

/// Plugins are not trusted with indices and view counts: a wrong index would make the build read
/// past the map. Errors of all functions: `internal`, which names the plugin and what it broke.
namespace vantage {

/// @param size  above every index
/// @param who   the kind of plugin that gave the indices
[[nodiscard]] Result<void> check_indices(const IndexList& indices, std::size_t size,
                                         const char* who);

/// @param viewpoints  number of viewpoints that were evaluated
[[nodiscard]] Result<void> check_views(const ViewCounts& counts, std::size_t viewpoints);

}  // namespace vantage
