#pragma once

#include <cstdint>
#include <optional>
#include <string_view>

#include "vantage/point_cloud.hpp"

namespace vantage::checks {

/// A direction of the map's frame.
struct Direction {
  int axis = 2;  ///< 0: x, 1: y, 2: z
  bool negative = false;

  friend bool operator==(const Direction&, const Direction&) = default;
};
/// "+z"
[[nodiscard]] std::string_view to_string(const Direction&) noexcept;

/// What the points of a map say about it, whatever its unit.
struct MapFacts {
  std::uint64_t points = 0;
  Bounds3 bulk;  ///< without the outermost 0.1 % of the points at each side [m]
  /// The distance of neighbouring points on a surface [m]: 1 / sqrt(points a square metre), median
  /// over the map; 0 for fewer than 100 points.
  double spacing = 0.0;
  double farthest_coordinate = 0.0;  ///< the largest absolute value of a coordinate [m]
  /// The step of 32-bit floats at `farthest_coordinate` [m]; 0 if the coordinates are finer.
  double rounding = 0.0;
  /// Where up is: the direction in which things stand on the ground. None if the map has too little
  /// ground or too few things on it, or if a ceiling resembles the ground.
  std::optional<Direction> up;
  /// The share of the ground plan's occupied cells that are flat. Seen along z.
  double flat_share = 0.0;
};

/// MapFacts::spacing alone. The result depends on the order of the points.
/// @param map  N points [m]; finite
[[nodiscard]] double spacing_of(PointsView map);

/// Measures a map. Looks at some of the points; takes about a second for 40 million. The result
/// does not depend on the number of threads.
/// @param map  N points [m]; finite
[[nodiscard]] MapFacts measure_map(PointsView map);

}  // namespace vantage::checks
