#pragma once

#include <cstddef>
#include <cstdint>
#include <vector>

#include "vantage/map_store.hpp"
#include "vantage/point_cloud.hpp"

namespace vantage::exporting {

/// The points of several region maps, each once.
///
/// A store may return one point of the wide-area map slightly differently from two region maps, a
/// few micrometres apart: pcd_tiles keeps float32 around an origin per region, exact to 2^-24 of
/// the region's extent. Two points of different maps that are no further apart than that count as
/// one. A point stands for at most one point of each other map, so that neighbours stay two points.
/// Two points of the same map count as one only if their coordinates are equal.
class UnionOfMaps {
 public:
  void add(const RegionMap& map);

  /// In the order in which they were added.
  [[nodiscard]] const PointCloud& points() const noexcept { return points_; }
  /// How many added points were there already.
  [[nodiscard]] std::uint64_t repeated() const noexcept { return repeated_; }

 private:
  /// The number of the point that is the same as `p`; the number of all points if there is none.
  [[nodiscard]] std::size_t find(const Point& p, double tolerance) const;
  void insert(const Point& p);
  void rebuild_slots();
  [[nodiscard]] std::size_t slot_of(double x, double y, double z) const;

  PointCloud points_;
  std::vector<std::uint32_t> last_map_;  // for each point, the last map that contains it
  // Open addressing, at most half full: 0, or the number of a point counted from 1. All points of a
  // cell lie between its slot and the next empty slot.
  std::vector<std::uint64_t> slots_;
  std::uint32_t map_ = 0;
  double largest_error_ = 0.0;  // of a coordinate in the maps so far [m]
  std::uint64_t repeated_ = 0;
};

}  // namespace vantage::exporting
