#pragma once

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <limits>
#include <vector>

#include "common/opening.hpp"
#include "vantage/point_cloud.hpp"
#include "vantage/result.hpp"

namespace vantage::terrain {

/// A cell of the lattice of multiples of the cell size.
struct Cell {
  std::int64_t x, y;
  friend bool operator==(const Cell&, const Cell&) = default;
};

[[nodiscard]] inline Cell cell_of(const Point& p, double size) noexcept {
  return {static_cast<std::int64_t>(std::floor(p.x() / size)),
          static_cast<std::int64_t>(std::floor(p.y() / size))};
}

/// Stands for "no point in this cell".
inline const Point kNoPoint = Point::Constant(std::numeric_limits<double>::infinity());
[[nodiscard]] inline bool is_point(const Point& p) noexcept {
  return p.z() != std::numeric_limits<double>::infinity();
}

/// The largest window that opens a raster.
struct LargestWindow {
  std::size_t radius;  ///< [cells]
  const char* key;     ///< of the parameter that sets the window
};

/// What makes a lowest point an outlier. The support of a cell is the number of cells around it
/// within `height` of its own height. The surface of a cell is its height, less `height`, less
/// `slope` times the distance. A cell is an outlier if it lies below the surface of a cell nearby
/// that has more than `ratio` times its support.
struct OutlierRule {
  double height;  ///< [m]
  double slope;   ///< rise over run
  double ratio;
};

/// Cells with their lowest points, in rows along x. Borrows the cloud.
class MinimumRaster {
 public:
  static constexpr int kNeighbourhood = 2;  ///< cells to each side that count as neighbours
  static constexpr int kOutlierPasses = 4;  ///< each finds what earlier outliers hid
  /// Everything that decides about outliers in a cell is at most this far away [cells].
  static constexpr int kOutlierReach = kOutlierPasses * 2 * kNeighbourhood;

  /// @param members  the points of which the raster is made; not empty
  /// Errors: `invalid_input` for a raster that is too large with the border that windows need.
  [[nodiscard]] static Result<MinimumRaster> over(PointsView cloud, IndexList members,
                                                  double cell_size, const LargestWindow& window);

  [[nodiscard]] std::size_t width() const noexcept { return width_; }
  [[nodiscard]] std::size_t height() const noexcept { return height_; }
  [[nodiscard]] std::size_t size() const noexcept { return lowest_.size(); }
  [[nodiscard]] double cell_size() const noexcept { return cell_size_; }
  [[nodiscard]] const Point& lowest(std::size_t cell) const noexcept { return lowest_[cell]; }
  [[nodiscard]] Eigen::Vector2d centre(std::size_t cell) const noexcept;
  /// Heights of the lowest points; +infinity where there is none.
  [[nodiscard]] Heights heights() const;

  /// Removes low outliers: reflections put points below the ground, and a minimum would take all of
  /// them. Afterwards, the lowest point of a former outlier is its lowest point that is not below
  /// the surface that separated the outlier from the ground, or none.
  void remove_low_outliers(const OutlierRule& rule);

  /// Calls visit(point, its index, its cell) for all members.
  template <class Visit>
  void for_members(const Visit& visit) const {
    for (std::size_t i = 0; i < members_.size(); ++i) {
      visit(cloud_[members_[i]], members_[i], std::size_t{cell_of_member_[i]});
    }
  }

  /// Calls visit(neighbour, distance [m]) for the cells around a cell, itself included, that have a
  /// lowest point.
  template <class Visit>
  void for_neighbours(std::size_t cell, const Visit& visit) const {
    const auto x0 = static_cast<int>(cell % width_), y0 = static_cast<int>(cell / width_);
    const int left = std::max(-x0, -kNeighbourhood), low = std::max(-y0, -kNeighbourhood);
    const int right = std::min(static_cast<int>(width_) - 1 - x0, kNeighbourhood);
    const int high = std::min(static_cast<int>(height_) - 1 - y0, kNeighbourhood);
    for (int dy = low; dy <= high; ++dy) {
      for (int dx = left; dx <= right; ++dx) {
        const auto neighbour =
            static_cast<std::size_t>(y0 + dy) * width_ + static_cast<std::size_t>(x0 + dx);
        if (z_[neighbour] != std::numeric_limits<double>::infinity())
          visit(neighbour, distances_[offset(dx, dy)]);
      }
    }
  }

 private:
  MinimumRaster(PointsView cloud, IndexList members, double cell_size, const Cell& min,
                std::size_t width, std::size_t height);
  void take_if_lower(std::size_t i) noexcept;
  void raise(const std::vector<std::size_t>& cells, const std::vector<double>& surfaces);
  [[nodiscard]] std::vector<std::size_t> around(const std::vector<std::size_t>& cells,
                                                std::size_t reach) const;
  [[nodiscard]] std::uint8_t support_of(std::size_t cell, double height) const;
  [[nodiscard]] std::vector<std::uint8_t> supports(double height) const;

  static constexpr std::size_t kSide = 2 * kNeighbourhood + 1;
  [[nodiscard]] static std::size_t offset(int dx, int dy) noexcept {
    return static_cast<std::size_t>(dy + kNeighbourhood) * kSide +
           static_cast<std::size_t>(dx + kNeighbourhood);
  }

  PointsView cloud_;
  IndexList members_;
  double cell_size_;
  Cell min_;
  std::size_t width_, height_;
  std::vector<std::uint32_t> cell_of_member_;
  std::vector<Point> lowest_;  // by cell: its lowest point that is not an outlier, or kNoPoint
  std::vector<double> z_;      // of `lowest_`; +infinity where there is none [m]
  std::array<double, kSide * kSide> distances_{};  // to the cells around a cell [m]
};

}  // namespace vantage::terrain
