#pragma once

#include <Eigen/Core>
#include <array>
#include <cstdint>
#include <span>
#include <string_view>
#include <vector>

#include "vantage/point_cloud.hpp"
#include "vantage/pose.hpp"

namespace vantage::simulation {

/// What a surface belongs to.
enum class Surface : std::uint8_t { ground, building, wall, vegetation, pole, car, overpass };

/// A plane convex polygon of a solid's surface; counter-clockwise seen from outside.
struct Face {
  std::vector<Point> corners;
  Eigen::Vector3d normal;  ///< unit, outward
};

/// A convex body [m]. A body that is not convex consists of several overlapping ones.
struct Solid {
  Surface surface;
  std::vector<Face> faces;
  Bounds3 bounds;

  /// Negative inside: minus the distance to the nearest face. Positive outside [m].
  [[nodiscard]] double signed_distance(const Point& p) const noexcept;
};

/// A triangle that is visible from both sides and encloses nothing.
using Leaf = std::array<Point, 3>;

/// A convex body made from its faces; the corners of a face may run in either direction.
/// Precondition: every face is plane and convex, and its first three corners are not on one line.
[[nodiscard]] Solid make_solid(Surface surface, std::vector<std::vector<Point>> faces);

/// @param frame  T_campus_body
[[nodiscard]] Solid make_box(Surface surface, const Pose& frame, const Point& min,
                             const Point& max);

/// A convex profile in the body's xz plane, extruded along y.
[[nodiscard]] Solid make_profile(Surface surface, const Pose& frame,
                                 std::span<const Eigen::Vector2d> profile, double y_min,
                                 double y_max);

/// Regular rings around the body's z axis: (radius, z) from low to high, convex. The last radius
/// may be 0, which makes a tip.
[[nodiscard]] Solid make_turned(Surface surface, const Pose& frame, int sides,
                                std::span<const Eigen::Vector2d> radius_z);

/// Finds the solids around a point. Borrows the solids.
class SolidIndex {
 public:
  SolidIndex(std::span<const Solid> solids, const Eigen::Vector2d& half_size);

  static constexpr std::uint32_t kNone = 0xffffffffU;
  /// Whether a point is inside a solid other than `except`, deeper than `depth` [m].
  [[nodiscard]] bool is_inside(const Point& p, std::uint32_t except = kNone,
                               double depth = 1e-6) const noexcept;

 private:
  [[nodiscard]] std::array<int, 2> bin(double x, double y) const noexcept;

  std::span<const Solid> solids_;
  Eigen::Vector2d half_size_;
  int columns_, rows_;
  std::vector<std::uint32_t> first_, members_;  // members of bin b: first_[b] .. first_[b + 1]
};

}  // namespace vantage::simulation
