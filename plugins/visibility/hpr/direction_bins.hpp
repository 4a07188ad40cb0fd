#pragma once

#include <Eigen/Core>
#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <limits>

namespace vantage::hpr {

/// Directions sorted into the cells of a cube about the viewpoint: six faces of
/// kBinsPerEdge x kBinsPerEdge cells. Bins are numbered row by row in alternating sense, so that
/// consecutive numbers are mostly neighbours.

inline constexpr std::uint32_t kBinsPerEdge = 256;
inline constexpr std::uint32_t kBins = 6 * kBinsPerEdge * kBinsPerEdge;
inline constexpr std::uint32_t kCorners = 6 * (kBinsPerEdge + 1) * (kBinsPerEdge + 1);

/// A bin's number and whether a direction is within rounding of the bin's edge.
enum class BinId : std::uint32_t {};
inline constexpr BinId kNoBin{std::numeric_limits<std::uint32_t>::max()};
inline constexpr std::uint32_t kNearEdge = 0x8000'0000U;

[[nodiscard]] constexpr std::uint32_t number_of(BinId id) {
  return static_cast<std::uint32_t>(id) & ~kNearEdge;
}
[[nodiscard]] constexpr bool near_edge(BinId id) {
  return (static_cast<std::uint32_t>(id) & kNearEdge) != 0;
}

struct Cell {
  std::uint32_t face, column, row;
};

[[nodiscard]] constexpr std::uint32_t number_of(Cell cell, std::uint32_t cells_per_edge) {
  const std::uint32_t along = cell.row % 2 == 0 ? cell.column : cells_per_edge - 1 - cell.column;
  return (cell.face * cells_per_edge + cell.row) * cells_per_edge + along;
}
[[nodiscard]] constexpr Cell cell_of(std::uint32_t number) {
  const std::uint32_t row = number / kBinsPerEdge % kBinsPerEdge;
  const std::uint32_t along = number % kBinsPerEdge;
  return {.face = number / (kBinsPerEdge * kBinsPerEdge),
          .column = row % 2 == 0 ? along : kBinsPerEdge - 1 - along,
          .row = row};
}

/// Bins of 2^shift x 2^shift cells.
[[nodiscard]] constexpr std::uint32_t bins_at(int shift) { return kBins >> (2 * shift); }
[[nodiscard]] constexpr std::uint32_t wider(std::uint32_t bin, int shift) {
  const Cell cell = cell_of(bin);
  return number_of({cell.face, cell.column >> shift, cell.row >> shift}, kBinsPerEdge >> shift);
}

/// The bin of a direction; p is not zero.
[[nodiscard]] inline BinId bin_of(const Eigen::Vector3d& p) {
  const double x = std::abs(p.x()), y = std::abs(p.y()), z = std::abs(p.z());
  const int axis = x >= y ? (x >= z ? 0 : 2) : (y >= z ? 1 : 2);
  const double toward = p[axis];
  const double scale = 0.5 * kBinsPerEdge / std::abs(toward);
  const double u = 0.5 * kBinsPerEdge + p[axis == 2 ? 0 : axis + 1] * scale;
  const double v = 0.5 * kBinsPerEdge + p[axis == 0 ? 2 : axis - 1] * scale;
  const auto column = std::min(static_cast<std::uint32_t>(u), kBinsPerEdge - 1);
  const auto row = std::min(static_cast<std::uint32_t>(v), kBinsPerEdge - 1);
  constexpr double kRounding = 1e-9;
  const double from_centre = std::max(std::abs(u - column - 0.5), std::abs(v - row - 0.5));
  const Cell cell{.face = static_cast<std::uint32_t>(2 * axis + (toward < 0.0 ? 1 : 0)),
                  .column = column,
                  .row = row};
  return BinId{number_of(cell, kBinsPerEdge) | (from_centre > 0.5 - kRounding ? kNearEdge : 0U)};
}

/// The numbers of the four corners of a bin, shared with its neighbours on the same face.
[[nodiscard]] constexpr std::array<std::uint32_t, 4> corners_of(std::uint32_t bin) {
  const Cell cell = cell_of(bin);
  const std::uint32_t first =
      (cell.face * (kBinsPerEdge + 1) + cell.row) * (kBinsPerEdge + 1) + cell.column;
  return {first, first + 1, first + kBinsPerEdge + 1, first + kBinsPerEdge + 2};
}

/// The direction of a corner, a unit vector.
[[nodiscard]] inline Eigen::Vector3d direction_of_corner(std::uint32_t corner) {
  constexpr std::uint32_t kPerEdge = kBinsPerEdge + 1;
  const std::uint32_t face = corner / (kPerEdge * kPerEdge);
  const double u = 2.0 * (corner % kPerEdge) / kBinsPerEdge - 1.0;
  const double v = 2.0 * (corner / kPerEdge % kPerEdge) / kBinsPerEdge - 1.0;
  const auto axis = static_cast<Eigen::Index>(face / 2);
  Eigen::Vector3d direction;
  direction[axis] = face % 2 == 0 ? 1.0 : -1.0;
  direction[axis == 2 ? 0 : axis + 1] = u;
  direction[axis == 0 ? 2 : axis - 1] = v;
  return direction.normalized();
}

}  // namespace vantage::hpr
