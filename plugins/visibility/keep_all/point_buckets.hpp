#pragma once

#include <array>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <functional>
#include <span>
#include <unordered_map>
#include <vector>

#include "vantage/point_cloud.hpp"

namespace vantage {

/// Groups the points of a map by the cells of a cubic grid, with the tightest box around the points
/// of each cell. Needs four bytes per point, twice that while the groups are made, and one box per
/// cell.
class PointBuckets {
 public:
  struct Bucket {
    Bounds3 bounds;
    std::uint32_t begin = 0, end = 0;  ///< of `indices`
  };

  /// @param map    finite points [m]
  /// @param width  edge of a cell [m], at least 1, so that no quotient overflows
  PointBuckets(PointsView map, double width) : indices_(map.size()) {
    std::unordered_map<Cell, std::uint32_t, CellHash> number_of;
    std::vector<std::uint32_t> bucket_of(map.size());
    Cell last{};
    for (std::size_t i = 0; i < map.size(); ++i) {
      const Cell cell = cell_of(map[i], width);
      if (i > 0 && cell == last) {  // neighbours in the map usually share a cell
        bucket_of[i] = bucket_of[i - 1];
      } else {
        const auto next = static_cast<std::uint32_t>(buckets_.size());
        bucket_of[i] = number_of.try_emplace(cell, next).first->second;
        if (bucket_of[i] == next) buckets_.emplace_back();
        last = cell;
      }
      Bucket& bucket = buckets_[bucket_of[i]];
      bucket.bounds.extend(map[i]);
      ++bucket.end;  // a count until all points are counted
    }
    std::uint32_t begin = 0;
    for (Bucket& bucket : buckets_) {
      const std::uint32_t size = bucket.end;
      bucket.begin = bucket.end = begin;
      begin += size;
    }
    for (std::uint32_t i = 0; i < map.size(); ++i) indices_[buckets_[bucket_of[i]].end++] = i;
  }

  [[nodiscard]] std::span<const Bucket> all() const noexcept { return buckets_; }

  /// The points of the map in `bucket`, ascending.
  [[nodiscard]] std::span<const std::uint32_t> indices(const Bucket& bucket) const noexcept {
    return std::span(indices_).subspan(bucket.begin, bucket.end - bucket.begin);
  }

 private:
  using Cell = std::array<double, 3>;  // whole numbers, perhaps too large for any integer type

  struct CellHash {
    std::size_t operator()(const Cell& cell) const noexcept {
      std::size_t hash = 0;
      for (const double x : cell) hash = 31 * hash + std::hash<double>{}(x);
      return hash;
    }
  };

  [[nodiscard]] static Cell cell_of(const Point& p, double width) noexcept {
    return {std::floor(p.x() / width), std::floor(p.y() / width), std::floor(p.z() / width)};
  }

  std::vector<Bucket> buckets_;
  std::vector<std::uint32_t> indices_;
};

}  // namespace vantage
