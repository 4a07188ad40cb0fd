#pragma once

#include <Eigen/Core>
#include <array>
#include <cstddef>
#include <optional>
#include <vector>

#include "simulate/objects.hpp"
#include "simulate/params.hpp"
#include "simulate/street_grid.hpp"

namespace vantage::simulation {

inline constexpr double kVerge = 2.4;  ///< beside a street, for cars, lamps and trees in a row [m]
inline constexpr double kVergeMiddle = 1.25;  ///< from the edge of the street [m]
inline constexpr double kBorder = 0.8;        ///< kept empty along the border of the campus [m]
inline constexpr double kGap = 2.6;           ///< between buildings and anything else [m]

/// The land between streets, without the verges; counter-clockwise: side k runs from corner k to
/// corner k + 1. Campus frame [m].
struct Block {
  std::array<Eigen::Vector2d, 4> corners;
  std::array<bool, 4> has_street;

  [[nodiscard]] const Eigen::Vector2d& corner(std::size_t k) const { return corners[k % 4]; }
  /// Unit vector.
  [[nodiscard]] Eigen::Vector2d along(std::size_t k) const;
  /// Unit vector to the left of side k.
  [[nodiscard]] Eigen::Vector2d inward(std::size_t k) const;
  [[nodiscard]] double length(std::size_t k) const;
  [[nodiscard]] double area() const;
  [[nodiscard]] bool contains(const Eigen::Vector2d& p, double margin) const;
  [[nodiscard]] bool contains(const Plot& plot, double margin) const;
};

/// The land between the streets around (i - 1, j - 1) and (i, j). Nothing if it is too small to
/// use.
[[nodiscard]] std::optional<Block> block_between(const StreetGrid& streets, double street_width,
                                                 int i, int j);

/// Whether a plot shares no point with others.
[[nodiscard]] bool is_free(const Plot& plot, const std::vector<Plot>& taken);

}  // namespace vantage::simulation
