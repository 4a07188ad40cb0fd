#pragma once

#include <cstdint>
#include <limits>
#include <optional>

#include "vantage/io/tiled_map.hpp"

/// What the reader and the writer of tiled maps share.
namespace vantage::io::tiles {

/// A canonical cell and how many points it holds.
struct Cell {
  std::int32_t x = 0, y = 0;
  std::uint64_t points = 0;
};

/// The largest coordinate of which every cell index has 32 bits [m]; the smallest is its negative.
inline constexpr double kLargestCoordinate =
    kCanonicalCell * static_cast<double>(std::numeric_limits<std::int32_t>::max());

/// Along one axis. Precondition: |coordinate| is at most kLargestCoordinate.
[[nodiscard]] inline std::int32_t cell_at(double coordinate) noexcept {
  return static_cast<std::int32_t>(canonical_cell(coordinate));
}

/// The largest whole number that is at most a / b, for b > 0.
[[nodiscard]] constexpr std::int64_t floor_quotient(std::int64_t a, std::int64_t b) noexcept {
  return a / b - (a % b < 0 ? 1 : 0);
}

[[nodiscard]] constexpr TileIndex tile_of(std::int32_t x, std::int32_t y,
                                          std::int64_t cells_a_side) noexcept {
  return {static_cast<std::int32_t>(floor_quotient(x, cells_a_side)),
          static_cast<std::int32_t>(floor_quotient(y, cells_a_side))};
}

/// The order in which tiles and the cells of a tile are stored: row by row.
template <class Index>
[[nodiscard]] constexpr bool before(const Index& a, const Index& b) noexcept {
  return a.y != b.y ? a.y < b.y : a.x < b.x;
}

}  // namespace vantage::io::tiles
