#pragma once

#include <cstdint>
#include <optional>
#include <string>

#include "vantage/partition.hpp"

namespace vantage::view {

enum class Coloring : std::uint8_t { height, region, views };
[[nodiscard]] const char* to_string(Coloring) noexcept;

/// What the window shows at the moment.
struct Controls {
  Coloring coloring = Coloring::height;
  std::optional<RegionId> region = {};  ///< the one whose map is shown; all if none
  bool borders = true, viewpoints = true, trajectory = true;
  int point_size = 2;  ///< [pixels]
};

/// What there is to be shown.
struct Shown {
  std::uint32_t regions = 0;  ///< 0 for a cloud
  bool trajectory = false;
};

/// What has to be done about a key.
enum class Reaction : std::uint8_t { none, points, lines, point_size, fit, picture, help, quit };

/// Changes what is shown as a key says. Letters are capitals.
[[nodiscard]] Reaction press(char key, Controls& controls, const Shown& shown);

/// One line for each key that does something here.
[[nodiscard]] std::string key_help(const Shown& shown);

}  // namespace vantage::view
