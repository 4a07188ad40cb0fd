#pragma once

#include <cstdint>
#include <optional>
#include <span>
#include <vector>

#include "star_hull.hpp"

namespace vantage::test {

/// A StarHull and what was added to it.
struct GrownHull {
  hpr::StarHull hull;
  std::vector<Point> points;  ///< by number; [0] is the origin

  /// Adds the point if it is outside.
  hpr::StarHull::Location put_in(const Point& p);

  struct Plane {
    Eigen::Vector3d outward;  ///< unit vector
    double offset;            ///< of the plane from the origin
  };
  /// Of every facet; of those of three vertices, three times.
  [[nodiscard]] std::vector<Plane> planes();
};

/// The hull of the points, put in one after the other; its first tetrahedron is of the first three
/// that span space with the origin. Nothing if no three do.
[[nodiscard]] std::optional<GrownHull> grown(std::span<const Point> points);

/// Whether all of the cone is below all planes, each lowered by a margin.
[[nodiscard]] bool below_all(const std::vector<GrownHull::Plane>& planes,
                             const hpr::StarHull::Cone& cone, double margin);

[[nodiscard]] hpr::StarHull::Cone cone_about(const Eigen::Vector3d& axis, double angle,
                                             double length);

}  // namespace vantage::test
