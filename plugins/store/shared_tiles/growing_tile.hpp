#pragma once

#include <array>
#include <compare>
#include <cstdint>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "selection.hpp"
#include "vantage/point_cloud.hpp"

namespace vantage::shared_tiles {

/// Row and column of a tile: tile (0, 0) has the map's origin at its corner.
using Square = std::array<std::int64_t, 2>;

/// A tile while regions are put: its points so far, in canonical order, and when each came.
class GrowingTile {
 public:
  /// @param width  [m]
  GrowingTile(const Square& square, double width) noexcept;

  /// Adds the points that are not here yet, and finds all of them: strictly ascending numbers among
  /// the points that are then here. Equal points are different ones. Nothing happens, and nothing
  /// is returned, if the points are not in canonical order.
  /// @param put  later calls have higher numbers
  [[nodiscard]] std::optional<std::vector<std::uint32_t>> pick(PointsView points,
                                                               std::uint32_t put);

  [[nodiscard]] const PointCloud& points() const noexcept { return points_; }
  /// In which call each point came.
  [[nodiscard]] const std::vector<std::uint32_t>& births() const noexcept { return births_; }
  [[nodiscard]] std::uint64_t memory() const noexcept {
    return sizeof *this + points_.capacity() * sizeof(Point) +
           keys_.capacity() * sizeof(std::uint64_t) + births_.capacity() * sizeof(std::uint32_t);
  }

  /// All that it knows, in bytes for this process only.
  [[nodiscard]] std::string encode() const;
  /// Takes what a tile of the same square has encoded. Precondition: this one has no points.
  void decode(std::string_view bytes);

 private:
  /// A point that is not here yet.
  struct Newcomer {
    Point point;
    std::uint64_t key;
    std::uint32_t before;  // which point it comes before
  };
  [[nodiscard]] std::uint64_t key_of(const Point& p) const noexcept;
  [[nodiscard]] bool precedes(std::uint32_t i, std::uint64_t key, const Point& p) const noexcept;
  void add(std::span<const Newcomer> newcomers, std::uint32_t put);

  std::array<double, 2> first_cell_;  // column, row of the tile's first canonical cell
  double middle_layer_ = 0.0;         // of the first point: heights may be those of ECEF
  PointCloud points_;
  std::vector<std::uint64_t> keys_;  // a lower one precedes; equal ones say nothing
  std::vector<std::uint32_t> births_;
};

/// What is left of a tile when all regions are put, for those that came before its last points.
class TileHistory {
 public:
  explicit TileHistory(std::vector<std::uint32_t> births);
  [[nodiscard]] std::uint32_t points() const noexcept {
    return static_cast<std::uint32_t>(births_.size());
  }
  [[nodiscard]] std::uint64_t memory() const noexcept {
    return sizeof *this + births_.capacity() * sizeof(std::uint32_t);
  }
  /// The numbers that picks have among all points.
  /// @param runs  of picks, ascending, among the points that came in `put` or before
  [[nodiscard]] std::vector<std::uint32_t> now(std::span<const Run> runs, std::uint32_t put) const;
  /// Whether no point came after `put`: the numbers are still the same.
  [[nodiscard]] bool over_after(std::uint32_t put) const noexcept { return last_ <= put; }

 private:
  std::vector<std::uint32_t> births_;
  std::uint32_t last_ = 0;
};

}  // namespace vantage::shared_tiles
