#pragma once

#include <utility>
#include <vector>

#include "vantage/partition.hpp"
#include "vantage/point_cloud.hpp"

namespace vantage::view {

struct Segment {
  Eigen::Vector2d a, b;
};

/// The border of a footprint: of a union of boxes only what borders on nothing of the union.
[[nodiscard]] std::vector<Segment> outline(const Footprint& footprint);

/// The lowest heights of points in plan-view cells, by which lines are laid over the terrain.
class Terrain {
 public:
  explicit Terrain(PointsView points);
  /// Height [m]; of the nearest cell with points within a few cells, else of the whole.
  [[nodiscard]] double height(const Eigen::Vector2d& xy) const noexcept;
  [[nodiscard]] double cell_size() const noexcept { return cell_; }

 private:
  [[nodiscard]] std::pair<int, int> cell_of(const Eigen::Vector2d& xy) const noexcept;
  [[nodiscard]] const double* at(int x, int y) const noexcept;
  double cell_ = 1.0;
  double fallback_ = 0.0;
  Eigen::Vector2d origin_ = Eigen::Vector2d::Zero();
  int columns_ = 0, rows_ = 0;
  std::vector<double> heights_;  // infinite where there are no points
};

/// A segment as a line over the terrain, `lift` [m] above it; both ends are the first and the last.
[[nodiscard]] PointCloud draped(const Segment& segment, const Terrain& terrain, double lift);

}  // namespace vantage::view
