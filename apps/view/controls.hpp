#pragma once

#include <cstdint>
#include <optional>
#include <string>

#include "vantage/partition.hpp"

namespace vantage::view {

enum class Coloring : std::uint8_t { height, region, views, localizability, contribution };
[[nodiscard]] const char* to_string(Coloring) noexcept;

/// What the window currently shows.
struct Controls {
  Coloring coloring = Coloring::height;
  std::optional<RegionId> region = {};  ///< the region whose map is shown; all if empty
  bool borders = true, viewpoints = true, trajectory = true;
  bool sites = true;   ///< of the atlas, if that is what colours show
  int point_size = 2;  ///< [pixels]
};

/// What there is to show.
struct Shown {
  std::uint32_t regions = 0;  ///< 0 for a cloud
  bool trajectory = false;
  bool atlas = false;     ///< of a bundle
  bool elements = false;  ///< of prepared maps with their contributions, instead of points
};

/// What a key makes necessary.
enum class Reaction : std::uint8_t { none, points, lines, point_size, fit, picture, help, quit };

/// Changes what is shown according to a key. Letters are capitals.
[[nodiscard]] Reaction press(char key, Controls& controls, const Shown& shown);

/// One line for each key that has an effect here.
[[nodiscard]] std::string key_help(const Shown& shown);

}  // namespace vantage::view
