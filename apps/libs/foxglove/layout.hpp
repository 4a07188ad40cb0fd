#pragma once

#include <array>
#include <string>
#include <vector>

namespace vantage::foxglove {

/// Values of the diagnostics that a layout plots.
struct Plot {
  std::string title;
  std::vector<std::string> keys;
};

/// What a layout shows.
struct LayoutNames {
  std::string map;                ///< topic; "" for none
  std::string scan, pose;         ///< topics
  std::string path = {};          ///< topic; "" for none
  std::string region;             ///< path to the region's label, for example /region.data
  std::string diagnostics;        ///< topic
  std::string status;             ///< the name of its status
  std::string map_frame, follow;  ///< frames: the second is followed
  std::array<Plot, 3> plots;      ///< the risk, the fit, times
};

/// The path to a value of the diagnostics. The values are strings; Foxglove plots those that are
/// numbers.
[[nodiscard]] std::string value_of(const std::string& diagnostics, const std::string& key);

/// A layout for Foxglove and Lichtblick, as JSON: the region map, the scan and the pose in 3-D;
/// state and region over time; plots; the diagnostics.
[[nodiscard]] std::string layout(const LayoutNames& names);

}  // namespace vantage::foxglove
