#pragma once

#include <utility>
#include <vector>

#include "vantage/partition.hpp"
#include "vantage/point_cloud.hpp"

namespace vantage::view {

struct Segment {
  Eigen::Vector2d a, b;
};

/// The border of a footprint; for a union of boxes, without the borders between its boxes.
[[nodiscard]] std::vector<Segment> outline(const Footprint& footprint);

/// The lowest heights of points in plan-view cells, for drawing lines on the terrain.
class Terrain {
 public:
  explicit Terrain(PointsView points);
  /// Height [m] of the nearest cell with points within a few cells; otherwise that of the whole
  /// terrain.
  [[nodiscard]] double height(const Eigen::Vector2d& xy) const noexcept;
  [[nodiscard]] double cell_size() const noexcept { return cell_; }

 private:
  [[nodiscard]] std::pair<int, int> cell_of(const Eigen::Vector2d& xy) const noexcept;
  [[nodiscard]] std::size_t index_of(int x, int y) const noexcept;
  [[nodiscard]] const double* at(int x, int y) const noexcept;
  double cell_ = 1.0;
  double fallback_ = 0.0;
  Eigen::Vector2d origin_ = Eigen::Vector2d::Zero();
  int columns_ = 0, rows_ = 0;
  std::vector<double> heights_;  // infinite where there are no points
};

/// A segment as a line on the terrain, `lift` [m] above it; the first and the last point are its
/// ends.
[[nodiscard]] PointCloud draped(const Segment& segment, const Terrain& terrain, double lift);

}  // namespace vantage::view
