#pragma once

#include <string>

namespace vantage {

/// A layout for Foxglove that shows the recording of a run, as JSON: the region map, the scan and
/// the pose in 3-D; state and region over time; plots of risk, fit and times; the diagnostics.
/// @param has_map  the recording has region maps
[[nodiscard]] std::string foxglove_layout(bool has_map);

}  // namespace vantage
