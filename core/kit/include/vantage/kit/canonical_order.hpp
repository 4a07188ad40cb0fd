#pragma once

#include <Eigen/Core>
#include <compare>
#include <cstdint>
#include <span>

#include "vantage/point_cloud.hpp"

/// The canonical order of a map's points. It depends on their coordinates only: not on the files
/// that they come from, nor on tiles. Points near each other in space are mostly near in it.
///
/// Points are sorted by cell, row by row; within a cell by layer, the lowest first; within such a
/// cube along Morton's curve (1966) through 1024 places a side; then by x, y and z.
namespace vantage {

/// The side of a canonical cell, and the height of a layer [m]. Cell (ix, iy) is the square
/// [5 ix, 5 ix + 5) x [5 iy, 5 iy + 5) of the map's frame.
inline constexpr double kCanonicalCell = 5.0;

/// Which cell or layer a coordinate [m] lies in: a whole number. The quotient is rounded, so a
/// coordinate just below a border may seem to be on it; the product of a cell and its side is
/// exact.
[[nodiscard]] double canonical_cell(double coordinate) noexcept;

/// Where a point comes in canonical order, but for x, y and z. Points of different places are in
/// the order of these.
struct CanonicalPlace {
  Point cell;             ///< column, row, layer: whole numbers
  std::uint32_t in_cube;  ///< along Morton's curve, 30 bits

  [[nodiscard]] static CanonicalPlace of(const Point& p) noexcept;
  [[nodiscard]] std::weak_ordering operator<=>(const CanonicalPlace& other) const noexcept;
  [[nodiscard]] bool operator==(const CanonicalPlace& other) const noexcept {
    return (*this <=> other) == 0;
  }
};

/// Whether a comes before b. Precondition: finite coordinates.
[[nodiscard]] bool canonically_before(const Point& a, const Point& b) noexcept;

/// Sorts the points of one cell. Equal points stay as they are.
/// Precondition: finite coordinates, < 2^32 points.
void sort_cell(std::span<Point> points);

}  // namespace vantage
