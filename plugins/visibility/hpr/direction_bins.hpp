#pragma once

#include <Eigen/Core>
#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <limits>

namespace vantage::hpr {

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

/// Directions sorted into the cells of a cube about the viewpoint: six faces of n x n cells, n a
/// power of two. Bins are numbered row by row in alternating sense, so that consecutive numbers are
/// mostly neighbours.
class DirectionBins {
 public:
  /// The widest `coarser` step: 2^4 x 2^4 cells.
  static constexpr int kMaxShift = 4;

  /// At least 16 cells an edge, and then as many as leave two points a bin on average.
  [[nodiscard]] static constexpr DirectionBins for_points(std::size_t points) {
    std::uint32_t edge = 1U << kMaxShift;
    while (edge < 512 && std::size_t{2} * 6 * (2 * edge) * (2 * edge) <= points) edge *= 2;
    return DirectionBins(edge);
  }

  [[nodiscard]] constexpr std::uint32_t edge() const { return edge_; }
  [[nodiscard]] constexpr std::uint32_t size() const { return 6 * edge_ * edge_; }
  [[nodiscard]] constexpr std::uint32_t corners() const { return 6 * (edge_ + 1) * (edge_ + 1); }

  /// Bins of 2^shift x 2^shift cells, and the one that holds a bin.
  [[nodiscard]] constexpr DirectionBins coarser(int shift) const {
    return DirectionBins(edge_ >> shift);
  }
  [[nodiscard]] constexpr std::uint32_t coarser_bin(std::uint32_t bin, int shift) const {
    const Cell cell = cell_of(bin);
    return coarser(shift).number_of({cell.face, cell.column >> shift, cell.row >> shift});
  }

  /// The bin of a direction; p is not zero.
  [[nodiscard]] BinId bin_of(const Eigen::Vector3d& p) const {
    constexpr double kRounding = 1e-9;
    const double x = std::abs(p.x()), y = std::abs(p.y()), z = std::abs(p.z());
    const int axis = x >= y ? (x >= z ? 0 : 2) : (y >= z ? 1 : 2);
    const double half = 0.5 * edge_, toward = p[axis], scale = half / std::abs(toward);
    const double u = half + p[first_across(axis)] * scale;
    const double v = half + p[second_across(axis)] * scale;
    const std::uint32_t column = std::min(static_cast<std::uint32_t>(u), edge_ - 1);
    const std::uint32_t row = std::min(static_cast<std::uint32_t>(v), edge_ - 1);
    const double off_centre = std::max(std::abs(u - column - 0.5), std::abs(v - row - 0.5));
    const auto face = static_cast<std::uint32_t>(2 * axis + (toward < 0.0 ? 1 : 0));
    return BinId{number_of({face, column, row}) | (off_centre > 0.5 - kRounding ? kNearEdge : 0U)};
  }

  /// The numbers of the four corners of a bin, shared with its neighbours on the same face.
  [[nodiscard]] constexpr std::array<std::uint32_t, 4> corners_of(std::uint32_t bin) const {
    const Cell cell = cell_of(bin);
    const std::uint32_t first = (cell.face * (edge_ + 1) + cell.row) * (edge_ + 1) + cell.column;
    return {first, first + 1, first + edge_ + 1, first + edge_ + 2};
  }

  /// The direction of a corner, a unit vector.
  [[nodiscard]] Eigen::Vector3d direction_of_corner(std::uint32_t corner) const {
    const std::uint32_t line = edge_ + 1, face = corner / (line * line);
    const int axis = static_cast<int>(face / 2);
    Eigen::Vector3d direction;
    direction[axis] = face % 2 == 0 ? 1.0 : -1.0;
    direction[first_across(axis)] = 2.0 * (corner % line) / edge_ - 1.0;
    direction[second_across(axis)] = 2.0 * (corner / line % line) / edge_ - 1.0;
    return direction.normalized();
  }

 private:
  struct Cell {
    std::uint32_t face, column, row;
  };

  explicit constexpr DirectionBins(std::uint32_t edge) : edge_(edge) {}

  [[nodiscard]] static constexpr int first_across(int axis) { return axis == 2 ? 0 : axis + 1; }
  [[nodiscard]] static constexpr int second_across(int axis) { return axis == 0 ? 2 : axis - 1; }

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

  std::uint32_t edge_;
};

}  // namespace vantage::hpr
