#include "view/borders.hpp"

#include <algorithm>
#include <cmath>
#include <limits>

#include "vantage/kit/overloaded.hpp"

namespace vantage::view {
namespace {

constexpr double kNone = std::numeric_limits<double>::infinity();

std::vector<Segment> closed(const std::vector<Eigen::Vector2d>& corners) {
  std::vector<Segment> segments;
  for (std::size_t i = 0; i < corners.size(); ++i) {
    segments.push_back({corners[i], corners[(i + 1) % corners.size()]});
  }
  return segments;
}

std::vector<Eigen::Vector2d> corners_of(const HalfOpenBox& box) {
  return {box.min, {box.max.x(), box.min.y()}, box.max, {box.min.x(), box.max.y()}};
}

/// The parts of [low, high] that no interval covers.
std::vector<std::pair<double, double>> uncovered(double low, double high,
                                                 std::vector<std::pair<double, double>> covers) {
  std::sort(covers.begin(), covers.end());
  std::vector<std::pair<double, double>> left;
  for (const auto& [from, to] : covers) {
    if (from > low) left.emplace_back(low, std::min(from, high));
    low = std::max(low, to);
    if (low >= high) return left;
  }
  left.emplace_back(low, high);
  return left;
}

/// The edges of box `i` along `axis` (0: those with x = const) that are edges of the union.
void add_edges(const std::vector<HalfOpenBox>& boxes, std::size_t i, int axis, bool upper,
               std::vector<Segment>& segments) {
  const int along = 1 - axis;
  const HalfOpenBox& box = boxes[i];
  const double edge = upper ? box.max[axis] : box.min[axis];
  std::vector<std::pair<double, double>> covers;
  for (std::size_t j = 0; j < boxes.size(); ++j) {
    const HalfOpenBox& other = boxes[j];
    // The place just outside the edge, on its far side.
    const bool beyond = upper ? other.min[axis] <= edge && edge < other.max[axis]
                              : other.min[axis] < edge && edge <= other.max[axis];
    if (j != i && beyond) covers.emplace_back(other.min[along], other.max[along]);
  }
  for (const auto& [from, to] : uncovered(box.min[along], box.max[along], std::move(covers))) {
    if (!(to > from)) continue;
    Segment segment;
    segment.a[axis] = segment.b[axis] = edge;
    segment.a[along] = from;
    segment.b[along] = to;
    segments.push_back(segment);
  }
}

}  // namespace

std::vector<Segment> outline(const Footprint& footprint) {
  return std::visit(Overloaded{[](const HalfOpenBox& box) { return closed(corners_of(box)); },
                               [](const ConvexPolygon& polygon) { return closed(polygon.corners); },
                               [](const BoxUnion& all) {
                                 std::vector<Segment> segments;
                                 for (std::size_t i = 0; i < all.boxes.size(); ++i) {
                                   for (const int axis : {0, 1}) {
                                     for (const bool upper : {false, true}) {
                                       add_edges(all.boxes, i, axis, upper, segments);
                                     }
                                   }
                                 }
                                 return segments;
                               }},
                    footprint);
}

Terrain::Terrain(PointsView points) {
  if (points.empty()) return;
  const Bounds3 bounds = bounds_of(points);
  const Eigen::Vector2d extent = (bounds.max - bounds.min).head<2>();
  cell_ = std::max(2.0, extent.maxCoeff() / 500.0);
  origin_ = bounds.min.head<2>();
  columns_ = static_cast<int>(extent.x() / cell_) + 1;
  rows_ = static_cast<int>(extent.y() / cell_) + 1;
  heights_.assign(static_cast<std::size_t>(columns_) * static_cast<std::size_t>(rows_), kNone);
  for (const Point& p : points) {
    const auto [x, y] = cell_of(p.head<2>());
    double& height = heights_[index_of(x, y)];
    height = std::min(height, p.z());
  }
  // A stray point below the ground must not pull a line down, so the median of the cell and its
  // neighbours is used.
  const std::vector<double> lowest = heights_;
  std::vector<double> around, all;
  for (int y = 0; y < rows_; ++y) {
    for (int x = 0; x < columns_; ++x) {
      const std::size_t i = index_of(x, y);
      if (lowest[i] == kNone) continue;
      around.clear();
      for (int v = std::max(0, y - 1); v <= std::min(rows_ - 1, y + 1); ++v) {
        for (int u = std::max(0, x - 1); u <= std::min(columns_ - 1, x + 1); ++u) {
          const double z = lowest[index_of(u, v)];
          if (z != kNone) around.push_back(z);
        }
      }
      const auto middle = around.begin() + static_cast<std::ptrdiff_t>(around.size() / 2);
      std::nth_element(around.begin(), middle, around.end());
      heights_[i] = *middle;
      all.push_back(*middle);
    }
  }
  const auto middle = all.begin() + static_cast<std::ptrdiff_t>(all.size() / 2);
  std::nth_element(all.begin(), middle, all.end());
  fallback_ = *middle;
}

std::size_t Terrain::index_of(int x, int y) const noexcept {
  return static_cast<std::size_t>(y) * static_cast<std::size_t>(columns_) +
         static_cast<std::size_t>(x);
}

std::pair<int, int> Terrain::cell_of(const Eigen::Vector2d& xy) const noexcept {
  const Eigen::Vector2d cell = (xy - origin_) / cell_;
  return {static_cast<int>(std::clamp(cell.x(), 0.0, columns_ - 1.0)),
          static_cast<int>(std::clamp(cell.y(), 0.0, rows_ - 1.0))};
}

const double* Terrain::at(int x, int y) const noexcept {
  if (x < 0 || y < 0 || x >= columns_ || y >= rows_) return nullptr;
  const double& height = heights_[index_of(x, y)];
  return height == kNone ? nullptr : &height;
}

double Terrain::height(const Eigen::Vector2d& xy) const noexcept {
  constexpr int kFarthest = 8;
  if (heights_.empty()) return 0.0;
  const auto [x, y] = cell_of(xy);
  for (int ring = 0; ring <= kFarthest; ++ring) {
    double sum = 0.0;
    int found = 0;
    for (int v = -ring; v <= ring; ++v) {
      for (int u = -ring; u <= ring; ++u) {
        if (std::max(std::abs(u), std::abs(v)) != ring) continue;
        if (const double* z = at(x + u, y + v)) {
          sum += *z;
          ++found;
        }
      }
    }
    if (found > 0) return sum / found;
  }
  return fallback_;
}

PointCloud draped(const Segment& segment, const Terrain& terrain, double lift) {
  const double length = (segment.b - segment.a).norm();
  const double pieces = std::clamp(std::ceil(length / terrain.cell_size()), 1.0, 2000.0);
  PointCloud line;
  for (int i = 0; i <= static_cast<int>(pieces); ++i) {
    const double t = i / pieces;
    const Eigen::Vector2d xy = (1.0 - t) * segment.a + t * segment.b;
    line.emplace_back(xy.x(), xy.y(), terrain.height(xy) + lift);
  }
  return line;
}

}  // namespace vantage::view
