#include "simulate/route.hpp"

#include <algorithm>
#include <cmath>

namespace vantage::simulation {
namespace {

constexpr double kStep = 0.05;           // [m]
constexpr double kBoxPerRadius = 2.121;  // w over the smallest radius of a right-angled turn

using Polygon = std::vector<Eigen::Vector2d>;

Eigen::Vector2d left_of(const Eigen::Vector2d& direction) {
  return {-direction.y(), direction.x()};
}

/// Moves every edge to the left; the new corners are where the moved edges meet.
Polygon moved_left(std::span<const Eigen::Vector2d> polygon, double offset) {
  Polygon moved;
  const std::size_t n = polygon.size();
  for (std::size_t i = 0; i < n; ++i) {
    const Eigen::Vector2d in = (polygon[i] - polygon[(i + n - 1) % n]).normalized();
    const Eigen::Vector2d out = (polygon[(i + 1) % n] - polygon[i]).normalized();
    const Eigen::Vector2d bisector = left_of(in) + left_of(out);
    moved.push_back(polygon[i] + bisector * (2.0 * offset / bisector.squaredNorm()));
  }
  return moved;
}

/// Points at equal distances along the closed polygon.
Polygon resampled(const Polygon& polygon, double step) {
  double length = 0.0;
  for (std::size_t i = 0; i < polygon.size(); ++i) {
    length += (polygon[(i + 1) % polygon.size()] - polygon[i]).norm();
  }
  const auto count = static_cast<std::size_t>(length / step);
  Polygon points;
  points.reserve(count);
  double passed = 0.0;
  std::size_t edge = 0;
  for (std::size_t k = 0; k < count; ++k) {
    const double at = length * static_cast<double>(k) / static_cast<double>(count);
    while (true) {
      const Eigen::Vector2d& a = polygon[edge];
      const Eigen::Vector2d& b = polygon[(edge + 1) % polygon.size()];
      const double edge_length = (b - a).norm();
      if (at <= passed + edge_length || edge + 1 == polygon.size()) {
        points.emplace_back(a + (b - a) * std::min(1.0, (at - passed) / edge_length));
        break;
      }
      passed += edge_length;
      ++edge;
    }
  }
  return points;
}

/// The mean of 2 * reach + 1 neighbours around each point of a closed polygon.
Polygon box_filtered(const Polygon& points, std::size_t reach) {
  const std::size_t n = points.size();
  const auto at = [&](std::size_t k) -> const Eigen::Vector2d& { return points[k % n]; };
  Polygon filtered;
  filtered.reserve(n);
  Eigen::Vector2d sum = Eigen::Vector2d::Zero();
  for (std::size_t k = 0; k < 2 * reach + 1; ++k) sum += at(n - reach + k);
  for (std::size_t k = 0; k < n; ++k) {
    filtered.emplace_back(sum / static_cast<double>(2 * reach + 1));
    sum += at(k + reach + 1) - at(n + k - reach);
  }
  return filtered;
}

}  // namespace

Route::Route(std::span<const Eigen::Vector2d> crossings, double lateral_offset,
             double turn_radius) {
  Polygon polygon = moved_left(crossings, lateral_offset);
  polygon.insert(polygon.begin(), (polygon[0] + polygon[1]) / 2.0);
  std::rotate(polygon.begin() + 1, polygon.begin() + 2, polygon.end());

  positions_ = resampled(polygon, kStep);
  const auto reach = std::min(static_cast<std::size_t>(kBoxPerRadius * turn_radius / kStep / 2.0),
                              positions_.size() / 8);
  for (int box = 0; box < 3; ++box) positions_ = box_filtered(positions_, reach);

  const std::size_t n = positions_.size();
  distances_.push_back(0.0);
  for (std::size_t k = 0; k < n; ++k) {
    const Eigen::Vector2d& next = positions_[(k + 1) % n];
    directions_.push_back((next - positions_[(k + n - 1) % n]).normalized());
    distances_.push_back(distances_.back() + (next - positions_[k]).norm());
  }
}

Route::Place Route::locate(double distance) const noexcept {
  double wrapped = std::fmod(distance, length());
  if (wrapped < 0.0) wrapped += length();
  const auto after = std::upper_bound(distances_.begin() + 1, distances_.end() - 1, wrapped);
  const auto k = static_cast<std::size_t>(after - distances_.begin()) - 1;
  const double fraction = (wrapped - distances_[k]) / (distances_[k + 1] - distances_[k]);
  return {k, (k + 1) % positions_.size(), fraction};
}

Eigen::Vector2d Route::position(double distance) const noexcept {
  const auto [before, after, fraction] = locate(distance);
  return positions_[before] + fraction * (positions_[after] - positions_[before]);
}

Eigen::Vector2d Route::direction(double distance) const noexcept {
  const auto [before, after, fraction] = locate(distance);
  return (directions_[before] + fraction * (directions_[after] - directions_[before])).normalized();
}

}  // namespace vantage::simulation
