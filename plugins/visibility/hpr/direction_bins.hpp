#pragma once

#include <Eigen/Core>
#include <algorithm>
#include <cmath>
#include <cstdint>

namespace vantage::hpr {

/// Directions sorted into the cells of a cube around the viewpoint: six faces of n x n cells, where
/// n is a power of two. Bins are numbered row by row in alternating directions, so that consecutive
/// numbers are mostly neighbours.
class DirectionBins {
 public:
  /// @param edge  n, a power of two
  explicit constexpr DirectionBins(std::uint32_t edge) : edge_(edge) {}

  [[nodiscard]] constexpr std::uint32_t edge() const { return edge_; }
  [[nodiscard]] constexpr std::uint32_t size() const { return 6 * edge_ * edge_; }

  /// The same with bins of 2^shift x 2^shift cells.
  [[nodiscard]] constexpr DirectionBins coarser(int shift) const {
    return DirectionBins(edge_ >> shift);
  }
  [[nodiscard]] constexpr std::uint32_t coarser_bin(std::uint32_t bin, int shift) const {
    const Cell cell = cell_of(bin);
    return coarser(shift).number_of({cell.face, cell.column >> shift, cell.row >> shift});
  }

  /// Where a direction meets the cube, in cells of that face; p is not zero.
  struct Place {
    std::uint32_t face;
    double column, row;
  };
  [[nodiscard]] Place place_of(const Eigen::Vector3d& p) const {
    const double x = std::abs(p.x()), y = std::abs(p.y()), z = std::abs(p.z());
    const int axis = x >= y ? (x >= z ? 0 : 2) : (y >= z ? 1 : 2);
    const double half = 0.5 * edge_, toward = p[axis], scale = half / std::abs(toward);
    return {.face = static_cast<std::uint32_t>(2 * axis + (toward < 0.0 ? 1 : 0)),
            .column = half + p[first_across(axis)] * scale,
            .row = half + p[second_across(axis)] * scale};
  }
  /// The direction of a place, which may lie beyond the face's edges; not of unit length.
  [[nodiscard]] Eigen::Vector3d direction_of(const Place& place) const {
    const int axis = static_cast<int>(place.face / 2);
    const double width = 2.0 / edge_;
    Eigen::Vector3d direction;
    direction[axis] = place.face % 2 == 0 ? 1.0 : -1.0;
    direction[first_across(axis)] = place.column * width - 1.0;
    direction[second_across(axis)] = place.row * width - 1.0;
    return direction;
  }

  /// The bin of a direction; p is not zero.
  [[nodiscard]] std::uint32_t bin_of(const Eigen::Vector3d& p) const {
    const Place place = place_of(p);
    const std::uint32_t column = std::min(static_cast<std::uint32_t>(place.column), edge_ - 1);
    const std::uint32_t row = std::min(static_cast<std::uint32_t>(place.row), edge_ - 1);
    return number_of({place.face, column, row});
  }

  /// The place of a bin among the 4^shift bins that `coarser_bin` joins, row by row in alternating
  /// directions.
  [[nodiscard]] constexpr std::uint32_t place_in_coarser(std::uint32_t bin, int shift) const {
    const Cell cell = cell_of(bin);
    const std::uint32_t width = 1U << shift, row = cell.row % width, column = cell.column % width;
    return row * width + (row % 2 == 0 ? column : width - 1 - column);
  }

  struct Cell {
    std::uint32_t face, column, row;
  };
  [[nodiscard]] constexpr std::uint32_t number_of(Cell cell) const {
    const std::uint32_t along = cell.row % 2 == 0 ? cell.column : edge_ - 1 - cell.column;
    return (cell.face * edge_ + cell.row) * edge_ + along;
  }
  [[nodiscard]] constexpr Cell cell_of(std::uint32_t number) const {
    const std::uint32_t row = number / edge_ % edge_, along = number % edge_;
    return {.face = number / (edge_ * edge_),
            .column = row % 2 == 0 ? along : edge_ - 1 - along,
            .row = row};
  }

 private:
  [[nodiscard]] static constexpr int first_across(int axis) { return axis == 2 ? 0 : axis + 1; }
  [[nodiscard]] static constexpr int second_across(int axis) { return axis == 0 ? 2 : axis - 1; }

  std::uint32_t edge_;
};

}  // namespace vantage::hpr
