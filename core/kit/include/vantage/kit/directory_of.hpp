#pragma once

#include <memory>

#include "vantage/map_store.hpp"
#include "vantage/region_directory.hpp"
#include "vantage/result.hpp"

namespace vantage {

/// A directory of an index in memory, for bundles of few regions.
/// Errors: `corrupt_data` for an index without a region, or with more or fewer summaries.
[[nodiscard]] Result<std::unique_ptr<const RegionDirectory>> directory_of(MapIndex index);

}  // namespace vantage
