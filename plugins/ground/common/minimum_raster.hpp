#pragma once

#include <cmath>
#include <cstddef>
#include <cstdint>
#include <limits>
#include <vector>

#include "common/opening.hpp"
#include "vantage/point_cloud.hpp"
#include "vantage/result.hpp"

namespace vantage::terrain {

/// Of the lattice of multiples of the cell size.
struct Cell {
  std::int64_t x, y;
  friend bool operator==(const Cell&, const Cell&) = default;
};

[[nodiscard]] inline Cell cell_of(const Point& p, double size) noexcept {
  return {static_cast<std::int64_t>(std::floor(p.x() / size)),
          static_cast<std::int64_t>(std::floor(p.y() / size))};
}

/// Stands for no point in a cell.
inline const Point kNoPoint = Point::Constant(std::numeric_limits<double>::infinity());
[[nodiscard]] inline bool is_point(const Point& p) noexcept { return p.z() != kNoPoint.z(); }

/// The largest window that opens a raster.
struct LargestWindow {
  std::size_t radius;  ///< [cells]
  const char* key;     ///< of the parameter that sets it
};

/// What makes a lowest point an outlier: the support of a cell is the number of cells around it
/// within `height` of its own. A cell is an outlier if it lies below the surface of a cell nearby
/// (its height, less `height`, less `slope` times the distance) that has more than `ratio` times
/// its support.
struct OutlierRule {
  double height;  ///< [m]
  double slope;   ///< rise over run
  double ratio;
};

/// Cells with the lowest of their points, in rows along x. Borrows the cloud.
class MinimumRaster {
 public:
  static constexpr int kNeighbourhood = 2;  ///< cells to each side that count as around a cell
  static constexpr int kOutlierPasses = 4;  ///< what hides below an outlier is seen in the next
  /// How far from a cell something may be that decides about outliers in it [cells].
  static constexpr int kOutlierReach = kOutlierPasses * 2 * kNeighbourhood;

  /// @param members  the points that the raster is made of; not empty
  /// Errors: `invalid_input` for a raster that is too large with the border that windows need.
  [[nodiscard]] static Result<MinimumRaster> over(PointsView cloud, IndexList members,
                                                  double cell_size, const LargestWindow& window);

  [[nodiscard]] std::size_t width() const noexcept { return width_; }
  [[nodiscard]] std::size_t height() const noexcept { return height_; }
  [[nodiscard]] std::size_t size() const noexcept { return lowest_.size(); }
  [[nodiscard]] double cell_size() const noexcept { return cell_size_; }
  [[nodiscard]] const Point& lowest(std::size_t cell) const noexcept { return lowest_[cell]; }
  [[nodiscard]] Eigen::Vector2d centre(std::size_t cell) const noexcept;
  /// Of the lowest points; +infinity for none.
  [[nodiscard]] Heights heights() const;

  /// Reflections put points below the ground, and a minimum takes them all. The lowest point of an
  /// outlier is afterwards the lowest one not below the surface that told it from the ground, or
  /// none.
  void remove_low_outliers(const OutlierRule& rule);

  /// Calls visit(point, its index, its cell) for all members.
  template <class Visit>
  void for_members(const Visit& visit) const {
    for (std::size_t i = 0; i < members_.size(); ++i) {
      visit(cloud_[members_[i]], members_[i], std::size_t{cell_of_member_[i]});
    }
  }

  /// Calls visit(neighbour, distance [m]) for the cells around one that have a lowest point.
  template <class Visit>
  void for_neighbours(std::size_t cell, const Visit& visit) const {
    const auto x0 = static_cast<std::int64_t>(cell % width_);
    const auto y0 = static_cast<std::int64_t>(cell / width_);
    for (int dy = -kNeighbourhood; dy <= kNeighbourhood; ++dy) {
      const std::int64_t y = y0 + dy;
      if (y < 0 || y >= static_cast<std::int64_t>(height_)) continue;
      for (int dx = -kNeighbourhood; dx <= kNeighbourhood; ++dx) {
        const std::int64_t x = x0 + dx;
        if (x < 0 || x >= static_cast<std::int64_t>(width_)) continue;
        const std::size_t neighbour =
            static_cast<std::size_t>(y) * width_ + static_cast<std::size_t>(x);
        if (is_point(lowest_[neighbour])) visit(neighbour, cell_size_ * std::hypot(dx, dy));
      }
    }
  }

 private:
  MinimumRaster(PointsView cloud, IndexList members, double cell_size, const Cell& min,
                std::size_t width, std::size_t height);
  void take_if_lower(std::size_t i) noexcept;
  [[nodiscard]] std::vector<std::uint8_t> supports(double height) const;

  PointsView cloud_;
  IndexList members_;
  double cell_size_;
  Cell min_;
  std::size_t width_, height_;
  std::vector<std::uint32_t> cell_of_member_;
  std::vector<Point> lowest_;  // by cell: its lowest point that is no outlier, or kNoPoint
};

}  // namespace vantage::terrain
