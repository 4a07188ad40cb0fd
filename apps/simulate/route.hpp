#pragma once

#include <Eigen/Core>
#include <cstddef>
#include <span>
#include <vector>

namespace vantage::simulation {

/// A smooth closed path in the plan, by distance driven. Campus frame [m].
///
/// The polygon through the crossings, moved sideways, is convolved over its length with a quadratic
/// B-spline (three boxes of width w): position, heading and curvature are continuous, and a
/// right-angled corner is turned with a smallest radius of w / 2.12 and cut by 0.28 w.
class Route {
 public:
  /// @param crossings       at least three, not all in one line, [m]
  /// @param lateral_offset  to the left of the polygon [m]
  /// @param turn_radius     smallest, of a right-angled turn [m]
  /// The path starts in the middle between the first two crossings.
  Route(std::span<const Eigen::Vector2d> crossings, double lateral_offset, double turn_radius);

  /// Of one lap [m].
  [[nodiscard]] double length() const noexcept { return distances_.back(); }
  /// At a distance from the start; goes on around after a lap.
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
