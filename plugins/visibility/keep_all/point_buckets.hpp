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

/// Which points of a map lie together: those of one cell of a cubic grid, with the tightest box
/// around them. Four bytes a point, and as many again while they are made; the box once a cell.
class PointBuckets {
 public:
  struct Bucket {
    Bounds3 bounds;
    std::uint32_t begin = 0, end = 0;  ///< of `indices`
  };

  /// @param map    finite points [m]
  /// @param width  edge of a cell [m], at least 1 so that no quotient overflows
  PointBuckets(PointsView map, double width) : indices_(map.size()) {
    std::unordered_map<Cell, std::uint32_t, CellHash> number_of;
    std::vector<std::uint32_t> bucket_of(map.size());
    Cell last{};
    for (std::size_t i = 0; i < map.size(); ++i) {
      const Cell cell = cell_of(map[i], width);
      if (i > 0 && cell == last) {  // neighbours in the map mostly share a cell
        bucket_of[i] = bucket_of[i - 1];
      } else {
        const auto next = static_cast<std::uint32_t>(buckets_.size());
        bucket_of[i] = number_of.try_emplace(cell, next).first->second;
        if (bucket_of[i] == next) buckets_.emplace_back();
        last = cell;
      }
      Bucket& bucket = buckets_[bucket_of[i]];
      bucket.bounds.extend(map[i]);
      ++bucket.end;  // a count until all are counted
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

  /// Which points of the map `bucket` holds, ascending.
  [[nodiscard]] std::span<const std::uint32_t> indices(const Bucket& bucket) const noexcept {
    return std::span(indices_).subspan(bucket.begin, bucket.end - bucket.begin);
  }

 private:
  using Cell = std::array<double, 3>;  // whole numbers that no integer type need hold

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
