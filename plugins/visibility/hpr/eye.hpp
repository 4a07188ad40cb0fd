#pragma once

#include <Eigen/Core>
#include <algorithm>
#include <cmath>
#include <limits>

#include "settings.hpp"
#include "vantage/point_cloud.hpp"

namespace vantage::hpr {

/// A viewpoint and how it transforms points (Eqs. 7-8). Every transformation of a point goes
/// through this class, so that a point's p* is the same number everywhere.
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

  /// Whether a point at that squared distance is in range and not at the viewpoint.
  [[nodiscard]] bool takes_part(double squared_distance) const {
    return squared_distance > kAtViewpoint * kAtViewpoint && squared_distance <= max_squared_;
  }

  /// |p*| of a point at that distance. For the inversion, R = 1 m, because R only scales all
  /// points.
  [[nodiscard]] double turned_length(double distance) const {
    return settings_.kernel == Kernel::spherical_flip ? 2.0 * settings_.radius - distance
                                                      : 1.0 / distance;
  }
  /// The distance of a point with that |p*|; the inverse of `turned_length`.
  [[nodiscard]] double distance_turned_to(double length) const {
    return settings_.kernel == Kernel::spherical_flip ? 2.0 * settings_.radius - length
                                                      : 1.0 / length;
  }
  /// p* of a point p~ at that distance.
  [[nodiscard]] Point turned(const Point& relative, double distance) const {
    return (turned_length(distance) / distance) * relative;
  }
  [[nodiscard]] Point turned(const Point& p) const {
    const Point r = relative(p);
    return turned(r, r.norm());
  }

  /// A closer point is at the viewpoint [m].
  static constexpr double kAtViewpoint = 1e-30;

 private:
  Point viewpoint_ = Point::Zero();
  Settings settings_;
  double max_squared_ = 0.0;
};

}  // namespace vantage::hpr
