#pragma once

#include <cstdint>
#include <unordered_map>
#include <vector>

#include "vantage/point_cloud.hpp"
#include "vantage/result.hpp"

namespace vantage::shared_tiles {

/// Numbers the points of regions: equal coordinates in two regions have the same number, and points
/// that are equal within a region have different ones. A number needs about 42 bytes.
class PointIds {
 public:
  static constexpr std::uint32_t kNone = 0xffff'ffff;

  /// @param expected  how many different points there may be, for an allocation at once
  explicit PointIds(std::uint64_t expected);

  /// The numbers of a region's points, in their order.
  /// @param region  different for each call
  /// Errors: `invalid_input` for 2^32 - 1 different points or more.
  [[nodiscard]] Result<std::vector<std::uint32_t>> of(PointsView region_points,
                                                      std::uint32_t region);

  /// By number.
  [[nodiscard]] const PointCloud& points() const noexcept { return points_; }
  /// How many regions have each point, by number.
  [[nodiscard]] const std::vector<std::uint32_t>& uses() const noexcept { return uses_; }
  /// Frees all but the points and their uses; no region can be added any more.
  void finish();

 private:
  [[nodiscard]] std::uint32_t find_or_add(const Point& p);
  [[nodiscard]] std::uint32_t add(const Point& p);
  void grow();

  PointCloud points_;
  std::vector<std::uint32_t> uses_;
  std::vector<std::uint32_t> last_region_;  // that had the point
  std::vector<std::uint32_t> follower_;     // that came after the point when it was last seen
  std::vector<std::uint32_t> slots_;        // of a hash table with linear probing
  std::unordered_map<std::uint32_t, std::uint32_t> twins_;  // the next point of equal coordinates
};

}  // namespace vantage::shared_tiles
