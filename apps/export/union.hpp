#pragma once

#include <cstddef>
#include <cstdint>
#include <vector>

#include "vantage/map_store.hpp"
#include "vantage/point_cloud.hpp"

namespace vantage::exporting {

/// The points of several region maps, each once.
///
/// A store may hand out one point of the wide-area map a few micrometres apart from two region
/// maps: pcd_tiles keeps float32 around an origin of each region's own, exact to 2^-24 of the
/// region's extent. So points of two maps that are no further apart than that are one; a point
/// stands for one point of each other map at most, so that neighbours stay two. Points of one map
/// are one only if their coordinates are the same.
class UnionOfMaps {
 public:
  void add(const RegionMap& map);

  /// In the order they came.
  [[nodiscard]] const PointCloud& points() const noexcept { return points_; }
  /// Points that were there already.
  [[nodiscard]] std::uint64_t repeated() const noexcept { return repeated_; }

 private:
  /// The number of the point that `p` is the same as, or how many there are.
  [[nodiscard]] std::size_t find(const Point& p, double tolerance) const;
  void insert(const Point& p);
  void rebuild_slots();
  [[nodiscard]] std::size_t slot_of(double x, double y, double z) const;

  PointCloud points_;
  std::vector<std::uint32_t> last_map_;  // of each point: the last one that has it
  // Open addressing, at most half full: 0, or the number of a point counted from 1. All points of a
  // cell are between its slot and the next empty one.
  std::vector<std::uint64_t> slots_;
  std::uint32_t map_ = 0;
  double largest_error_ = 0.0;  // of a coordinate of the maps so far [m]
  std::uint64_t repeated_ = 0;
};

}  // namespace vantage::exporting
