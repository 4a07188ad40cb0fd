#pragma once

#include <Eigen/Core>
#include <algorithm>
#include <cmath>
#include <limits>

#include "settings.hpp"
#include "vantage/point_cloud.hpp"

namespace vantage::hpr {

/// A viewpoint and what it makes of points (Eqs. 7-8). Everything that turns a point goes through
/// here, so that a point's p* is the same number wherever it is needed.
class Eye {
 public:
  Eye() = default;
  Eye(const Point& viewpoint, const Settings& settings)
      : viewpoint_(viewpoint),
        settings_(settings),
        max_squared_(settings.max_range * settings.max_range) {}

  [[nodiscard]] const Point& viewpoint() const { return viewpoint_; }
  [[nodiscard]] const Settings& settings() const { return settings_; }

  /// p~ of Eq. 7.
  [[nodiscard]] Point relative(const Point& p) const { return p - viewpoint_; }

  /// Whether a point at that squared distance is neither at the viewpoint nor out of range.
  [[nodiscard]] bool takes_part(double squared_distance) const {
    return squared_distance > kAtViewpoint * kAtViewpoint && squared_distance <= max_squared_;
  }

  /// |p*| of a point at that distance; the inversion for R = 1 m, for all R only scale it.
  [[nodiscard]] double turned_length(double distance) const {
    return settings_.kernel == Kernel::spherical_flip ? 2.0 * settings_.radius - distance
                                                      : 1.0 / distance;
  }
  /// The distance of a point whose |p*| is that; the inverse of `turned_length`.
  [[nodiscard]] double distance_turned_to(double length) const {
    return settings_.kernel == Kernel::spherical_flip ? 2.0 * settings_.radius - length
                                                      : 1.0 / length;
  }
  /// p* of p~ at that distance.
  [[nodiscard]] Point turned(const Point& relative, double distance) const {
    return (turned_length(distance) / distance) * relative;
  }
  [[nodiscard]] Point turned(const Point& p) const {
    const Point r = relative(p);
    return turned(r, r.norm());
  }

  /// What is closer is at the viewpoint [m].
  static constexpr double kAtViewpoint = 1e-30;

 private:
  Point viewpoint_ = Point::Zero();
  Settings settings_;
  double max_squared_ = 0.0;
};

}  // namespace vantage::hpr
