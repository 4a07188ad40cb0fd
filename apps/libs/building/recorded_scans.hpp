#pragma once

#include <vector>

#include "vantage/build/build.hpp"
#include "vantage/engine/config.hpp"
#include "vantage/result.hpp"

namespace vantage::building {

/// The scans of `[selector] scans` with their poses from `[selector] poses`, or else from the map's
/// trajectory; empty if the selector has none. Scans closer than 2 m to the one before are left
/// out, and the points of a sweep are moved to where they would have been seen at its middle.
/// Errors: those of the files; `invalid_input` if no scan has a pose.
[[nodiscard]] Result<std::vector<LocatedScan>> recorded_scans(const Config& config);

}  // namespace vantage::building
