#pragma once

#include "checks/map_facts.hpp"
#include "info/lines.hpp"

namespace vantage {

/// What was measured of a map: spacing, up, ground, rounding.
[[nodiscard]] Lines map_lines(const checks::MapFacts& map);

}  // namespace vantage
