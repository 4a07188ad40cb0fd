#pragma once

#include <Eigen/Core>
#include <cstddef>
#include <span>
#include <vector>

namespace vantage::simulation {

/// A smooth closed path in plan view, parametrized by the distance driven. Campus frame [m].
///
/// The polygon through the crossings is moved sideways and convolved along its length with a
/// quadratic B-spline (three boxes of width w). Position, heading and curvature are continuous. In
/// a right-angled corner, the smallest radius is w / 2.12, and the path cuts the corner by 0.28 w.
class Route {
 public:
  /// @param crossings       at least three, not all on one line [m]
  /// @param lateral_offset  to the left of the polygon [m]
  /// @param turn_radius     smallest radius of a right-angled turn [m]
  /// The path starts halfway between the first two crossings.
  Route(std::span<const Eigen::Vector2d> crossings, double lateral_offset, double turn_radius);

  /// The length of one lap [m].
  [[nodiscard]] double length() const noexcept { return distances_.back(); }
  /// The position at a distance from the start; after a lap, the path starts again. A negative
  /// distance is before the start.
  [[nodiscard]] Eigen::Vector2d position(double distance) const noexcept;
  /// Unit vector.
  [[nodiscard]] Eigen::Vector2d direction(double distance) const noexcept;

 private:
  struct Place {
    std::size_t before, after;
    double fraction;
  };
  [[nodiscard]] Place locate(double distance) const noexcept;

  std::vector<Eigen::Vector2d> positions_, directions_;
  std::vector<double> distances_;  // of positions_, and of the first one after a lap
};

}  // namespace vantage::simulation
