#pragma once

#include <Eigen/Core>
#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <limits>
#include <vector>

#include "direction_bins.hpp"
#include "eye.hpp"
#include "star_hull.hpp"

namespace vantage::hpr {

/// For each cell of directions, the distance from which on all points are inside a hull. This is a
/// depth buffer on the faces of a cube around the viewpoint; a cell of each coarser level has the
/// largest distance of its 2 x 2 finer cells (a hierarchical z-buffer; Greene, Kass, Miller 1993).
/// It is filled tile by tile, when enough points have been asked. Its answers stay true while the
/// hull grows.
class OcclusionMap {
 public:
  static constexpr int kCoarsest = 5, kFinest = 8;  ///< 2^k x 2^k cells per face
  /// A tile is a cell of the coarsest level.
  static constexpr DirectionBins kTiles{1U << kCoarsest};

  OcclusionMap();

  /// Forgets everything.
  void clear() { ++stamp_; }

  /// Says that the hull has a new vertex in the directions of a tile. After enough new vertices,
  /// the tile is filled again at the next query.
  void hull_grew_in(std::uint32_t tile) { ++tiles_[tile].vertices; }

  /// A box relative to the viewpoint [m], and a distance that is not larger than that of its
  /// nearest point.
  struct Box {
    Eigen::Vector3d low, high;
    double nearest;
  };
  enum class Answer : std::uint8_t { hidden, not_plain, not_on_one_face };
  /// Whether all points of a box are inside the hull.
  /// @param fill_tile  a function that calls `fill` for the given tile
  template <class FillTile>
  [[nodiscard]] Answer hides(const Box& box, const FillTile& fill_tile);

  /// Whether a point is certainly inside the hull; false if that is not clear.
  /// @param p  relative to the viewpoint [m], not 0
  template <class FillTile>
  [[nodiscard]] bool hides(const Point& p, double squared_distance, const FillTile& fill_tile);

  void fill(std::uint32_t tile, const Eye& eye, StarHull& hull);

  /// The middle of the place that many columns and rows beside a tile, as if the tile's face
  /// continued.
  [[nodiscard]] static Eigen::Vector3d direction_beside(std::uint32_t tile, int columns, int rows);

 private:
  // A tile is worth filling after this many points were asked of it; a box counts as several
  // points.
  static constexpr std::uint32_t kWorthFilling = 64, kPointsOfBox = 8;
  static constexpr std::uint32_t kGrown = 16;  // vertices
  static constexpr double kMostCells = 8.0;    // that a box may cover, along a side
  static constexpr std::size_t kCells =
      ((std::size_t{1} << (2 * (kFinest - kCoarsest + 1))) - 1) / 3;  // of all levels of a tile

  struct Tile {
    std::uint32_t asked_stamp = 0, filled_stamp = 0;  // equal to `stamp_` if this happened since it
                                                      // was cleared
    std::uint32_t asked = 0;                          // before the tile is filled
    std::uint32_t vertices = 0;                       // of the hull, since the tile was filled
    std::array<float, kCells> squared;  // distances [m^2], from the coarsest level, row by row
  };
  static constexpr std::size_t first_of(int level) {
    return ((std::size_t{1} << (2 * (level - kCoarsest))) - 1) / 3;
  }

  /// The squared distance of a cell; infinite as long as its tile is not worth filling.
  template <class FillTile>
  [[nodiscard]] float squared_at(int level, std::uint32_t face, std::uint32_t column,
                                 std::uint32_t row, std::uint32_t points,
                                 const FillTile& fill_tile);

  std::vector<Tile> tiles_;
  std::uint32_t stamp_ = 1;
};

template <class FillTile>
float OcclusionMap::squared_at(int level, std::uint32_t face, std::uint32_t column,
                               std::uint32_t row, std::uint32_t points, const FillTile& fill_tile) {
  const int shift = level - kCoarsest;
  const std::uint32_t number = kTiles.number_of({face, column >> shift, row >> shift});
  Tile& tile = tiles_[number];
  if (tile.filled_stamp != stamp_) {
    if (tile.asked_stamp != stamp_) tile.asked = 0;
    tile.asked_stamp = stamp_;
    tile.asked += points;
    if (tile.asked < kWorthFilling) return std::numeric_limits<float>::infinity();
    fill_tile(number);
  } else if (tile.vertices >= kGrown) {
    fill_tile(number);
  }
  const std::uint32_t inside = (1U << shift) - 1U;
  return tile.squared[first_of(level) + ((row & inside) << shift) + (column & inside)];
}

template <class FillTile>
OcclusionMap::Answer OcclusionMap::hides(const Box& box, const FillTile& fill_tile) {
  Eigen::Index axis = 0;
  (box.low + box.high).cwiseAbs().maxCoeff(&axis);
  const bool backward = box.low[axis] + box.high[axis] < 0.0;
  const double closest = backward ? -box.high[axis] : box.low[axis];
  const double farthest = backward ? -box.low[axis] : box.high[axis];
  if (!(closest > 0.0)) return Answer::not_on_one_face;
  // The extent of the box on the face: offsets across the axis, divided by the offset along the
  // axis.
  constexpr double kRounding = 1e-9, kSide = 1.0 - 1e-12;
  const double per_closest = 1.0 / closest, per_farthest = 1.0 / farthest;
  const auto lowest = [&](double x) {
    return x * (x > 0.0 ? per_farthest : per_closest) - kRounding;
  };
  const auto highest = [&](double x) {
    return x * (x > 0.0 ? per_closest : per_farthest) + kRounding;
  };
  const double v0 = lowest(box.low[(axis + 1) % 3]), v1 = highest(box.high[(axis + 1) % 3]);
  const double w0 = lowest(box.low[(axis + 2) % 3]), w1 = highest(box.high[(axis + 2) % 3]);
  if (!(v0 > -kSide && v1 < kSide && w0 > -kSide && w1 < kSide)) return Answer::not_on_one_face;

  const int level = std::min(kFinest, std::ilogb(kMostCells / std::max(v1 - v0, w1 - w0)));
  if (level < kCoarsest) return Answer::not_plain;
  const double half = 0.5 * (1 << level);
  const auto cell = [&](double x) { return static_cast<std::uint32_t>(half * (1.0 + x)); };
  const auto face = static_cast<std::uint32_t>(2 * axis + (backward ? 1 : 0));
  const double squared = box.nearest * box.nearest;
  for (std::uint32_t row = cell(w0); row <= cell(w1); ++row) {
    for (std::uint32_t column = cell(v0); column <= cell(v1); ++column) {
      if (!(squared > squared_at(level, face, column, row, kPointsOfBox, fill_tile))) {
        return Answer::not_plain;
      }
    }
  }
  return Answer::hidden;
}

template <class FillTile>
bool OcclusionMap::hides(const Point& p, double squared_distance, const FillTile& fill_tile) {
  constexpr DirectionBins kFinestCells(1U << kFinest);
  const DirectionBins::Place place = kFinestCells.place_of(p);
  const auto column = static_cast<std::uint32_t>(place.column);
  const auto row = static_cast<std::uint32_t>(place.row);
  // Rounding must not put the point into another cell.
  constexpr double kInside = 0.5 - 1e-9;
  if (!(std::abs(place.column - column - 0.5) < kInside &&
        std::abs(place.row - row - 0.5) < kInside)) {
    return false;
  }
  return squared_distance > squared_at(kFinest, place.face, column, row, 1, fill_tile);
}

}  // namespace vantage::hpr
