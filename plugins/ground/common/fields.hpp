#pragma once

#include "vantage/params.hpp"

/// Parameters that every filter on a raster of minima has, for its schema.
namespace vantage::terrain {

template <class Params>
[[nodiscard]] constexpr auto cell_size_field(double Params::*member, const Source& source) {
  return optional("cell_size", member, "m", "width of a cell of the raster of minima", positive,
                  source);
}

template <class Params>
[[nodiscard]] constexpr auto slope_field(double Params::*member, const Source& source) {
  return optional("slope", member, "", "steepest terrain, rise over run", non_negative, source);
}

/// OutlierRule::ratio
template <class Params>
[[nodiscard]] constexpr auto outlier_ratio_field(double Params::*member) {
  return optional(
      "outlier_ratio", member, "",
      "a low cell is an outlier if a higher cell nearby has this many times its support",
      at_least(1.0));
}

}  // namespace vantage::terrain
