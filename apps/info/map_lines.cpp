#include "info/map_lines.hpp"

#include <fmt/format.h>

#include <string>

namespace vantage {

Lines map_lines(const checks::MapFacts& map) {
  return {{"point spacing [m]", fmt::format("{:.3g}", map.spacing)},
          {"up", map.up ? std::string(to_string(*map.up)) : std::string("cannot be told")},
          {"flat ground", fmt::format("{:.0f} % of the ground plan", 100.0 * map.flat_share)},
          {"rounding", map.rounding > 0.0 ? fmt::format("32-bit floats, {:.2g} m apart at {:.0f} m",
                                                        map.rounding, map.farthest_coordinate)
                                          : std::string("finer than 32-bit floats")}};
}

}  // namespace vantage
