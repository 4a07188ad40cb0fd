#include "occlusion_map.hpp"

#include <algorithm>
#include <limits>

namespace vantage::hpr {

OcclusionMap::OcclusionMap() : tiles_(kTiles.size()) {}

Eigen::Vector3d OcclusionMap::direction_beside(std::uint32_t tile, int columns, int rows) {
  const DirectionBins::Cell cell = kTiles.cell_of(tile);
  return kTiles.direction_of({.face = cell.face,
                              .column = static_cast<int>(cell.column) + columns + 0.5,
                              .row = static_cast<int>(cell.row) + rows + 0.5});
}

// A cell's points are inside up to a length if the cell's corners at that length are inside; the
// length is shortened by what the chord between the corners cuts off.
void OcclusionMap::fill(std::uint32_t number, const Eye& eye, StarHull& hull) {
  constexpr int kEdge = 1 << (kFinest - kCoarsest);  // cells
  constexpr double kWidth = 2.0 / (1 << kFinest);
  const DirectionBins::Cell cell = kTiles.cell_of(number);
  const auto at = [&](std::uint32_t of_tile, int k) {
    return (static_cast<int>(of_tile) * kEdge + k) * kWidth - 1.0;
  };
  constexpr std::size_t kCorners = kEdge + 1;  // in a row
  std::array<std::array<double, kCorners>, kCorners> reach;
  for (std::size_t row = 0; row < kCorners; ++row) {
    for (std::size_t k = 0; k < kCorners; ++k) {
      const std::size_t column = row % 2 == 0 ? k : kEdge - k;
      const Eigen::Vector3d direction =
          DirectionBins(1U << kFinest)
              .direction_of({.face = cell.face,
                             .column = static_cast<double>(cell.column * kEdge + column),
                             .row = static_cast<double>(cell.row * kEdge + row)});
      reach[row][column] = hull.reach(direction.normalized());
    }
  }
  Tile& tile = tiles_[number];
  float* out = tile.squared.data() + first_of(kFinest);
  for (int row = 0; row < kEdge; ++row) {
    for (int column = 0; column < kEdge; ++column) {
      const double v0 = at(cell.column, column), w0 = at(cell.row, row);
      const double v = std::min(std::abs(v0), std::abs(v0 + kWidth));
      const double w = std::min(std::abs(w0), std::abs(w0 + kWidth));
      const double shrink = 1.0 - 0.25 * 1.000001 * kWidth * kWidth / (1.0 + v * v + w * w);
      const double length = shrink * std::min({reach[row][column], reach[row][column + 1],
                                               reach[row + 1][column], reach[row + 1][column + 1]});
      const double beyond = length > 0.0 ? eye.distance_turned_to((1.0 - 1e-12) * length)
                                         : std::numeric_limits<double>::infinity();
      *out++ = std::max(std::numeric_limits<float>::min(),  // smaller numbers lose digits
                        static_cast<float>((1.0 + 1e-6) * beyond * beyond));
    }
  }
  for (int level = kFinest - 1; level >= kCoarsest; --level) {
    const int edge = 1 << (level - kCoarsest);
    const float* finer = tile.squared.data() + first_of(level + 1);
    float* coarser = tile.squared.data() + first_of(level);
    for (int row = 0; row < edge; ++row) {
      for (int column = 0; column < edge; ++column) {
        const float* a = finer + 4 * row * edge + 2 * column;
        const float* b = a + 2 * edge;
        coarser[row * edge + column] = std::max({a[0], a[1], b[0], b[1]});
      }
    }
  }
  tile.filled_stamp = stamp_;
  tile.vertices = 0;
}

}  // namespace vantage::hpr
