#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "vantage/point_cloud.hpp"

namespace vantage::test {

/// The convex hull of some points and the origin in exact arithmetic: the judge of hidden point
/// removal. Coordinates count as the numbers that they are; nothing is rounded, there is no
/// tolerance.
///
/// p is a vertex iff one plane has p on one side and everything else strictly on the other, that is
/// iff some n has n . (p - x) > 0 for all x in the set that are not at p's place, and n . p > 0.
/// This strict system is solved one constraint after the other (Seidel 1991): while n meets the
/// next one it stays; where it does not, a solution of all up to this one exists iff one exists in
/// the plane n . (p - x) = 0 that meets those before strictly, which is the same problem in a
/// plane.
///
/// A double is an integer times a power of two. With one power for the whole set all signs are
/// those of integers. A sign is taken from doubles where the rounding error (5 steps) cannot change
/// it. Not to be used by two threads at once.
class ExactHull {
 public:
  /// @param points  finite; everything that `add` and `is_vertex` may be given is among them
  explicit ExactHull(std::span<const Point> points);

  /// Joins a point to the set, which holds nothing but the origin at first. O(1).
  void add(const Point& p);

  /// Whether p is a vertex of the hull of the set, p and the origin; a vertex at the origin does
  /// not count. Points of the set at p's place are p itself. O(size) expected for a set in random
  /// order.
  [[nodiscard]] bool is_vertex(const Point& p);

  /// True if n . (p - x) > 0 for all x of the set and the origin beyond rounding, which makes p a
  /// vertex; false says nothing.
  [[nodiscard]] bool is_vertex_by(const Point& n, const Point& p) const;

 private:
  class Apex;

  int power_;                 // every coordinate is an integer times 2^power_
  std::vector<Point> hints_;  // points of the set that decided lately; only to be fast
  std::size_t next_hint_ = 0;
  std::vector<Point> set_;
};

/// The indices of the points that are vertices of the hull of all points and the origin, exactly;
/// strictly ascending. Points at one place are all vertices or none is. Qhull's hull is where the
/// search starts and has no influence on the result.
[[nodiscard]] std::vector<std::uint32_t> hull_vertices(std::span<const Point> points);

/// The same question for one of the points, against all others. O(N) expected.
[[nodiscard]] bool is_vertex(std::span<const Point> points, std::size_t k);

}  // namespace vantage::test
