#pragma once

#include <Eigen/Core>
#include <array>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <span>
#include <vector>

#include "vantage/point_cloud.hpp"

namespace vantage::hpr {

/// The convex hull of the origin and of points that are put in one after the other.
///
/// Every decision that shapes the hull is the sign of a determinant whose rounding error is bounded
/// (Shewchuk 1997, Sec. 4.3, stage A); a point for which a sign is not certain is left out and
/// reported as `undecided`. So the hull is at any time exactly the hull of the origin and of the
/// points that were inserted, and `inside` is a proof.
///
/// The hull is star-shaped about the origin: a point is located by walking over the cones that the
/// origin forms with the facets. Where the origin itself is on the hull, the facets that hold it
/// (`lateral` ones) end the walk.
class StarHull {
 public:
  enum class Verdict : std::uint8_t {
    inserted,    ///< outside: now a vertex (until later points bury it)
    inside,      ///< strictly inside or on the way of no facet: no vertex of any larger hull
    coincident,  ///< at exactly the place of a vertex
    undecided,   ///< too close to a facet to tell; the hull is unchanged
  };
  struct Insertion {
    Verdict verdict;
    std::uint32_t vertex;  ///< for `inserted` and `coincident`
  };

  /// The tetrahedron of the origin and three points; nothing if it may be flat.
  /// @param extent         bound on every coordinate of every point that will be inserted
  /// @param expected_size  how many vertices to make room for
  [[nodiscard]] static std::optional<StarHull> from(const Point& a, const Point& b, const Point& c,
                                                    double extent, std::size_t expected_size);

  /// Puts one more point in. Cheapest where consecutive points have nearby directions.
  [[nodiscard]] Insertion insert(const Point& p);

  /// A length not larger than how far the hull reaches from the origin in direction u, and usually
  /// the same; 0 where the facet is not certain.
  /// @param u  unit vector
  [[nodiscard]] double reach(const Eigen::Vector3d& u);

  /// Whether a ball of that radius about p fits into one of the tetrahedra (origin, facet).
  [[nodiscard]] bool holds_ball(const Point& p, double radius);

  /// Vertices on the hull now: numbers counted in the order of insertion; a, b, c are 1, 2, 3 and
  /// the origin, which is 0, is not listed. Strictly ascending.
  [[nodiscard]] std::vector<std::uint32_t> vertices() const;

 private:
  using Index = std::uint32_t;
  enum class Sign : std::int8_t { negative = -1, uncertain = 0, positive = 1 };

  struct Facet {
    Eigen::Vector3d normal;                // outward, (v1 - v0) x (v2 - v0)
    double error;                          // of height(), for |p - v0|_1 = 1
    std::array<Eigen::Vector3d, 3> sides;  // sides[i] = v[i] x v[i+1], toward the facet's cone
    std::array<Index, 3> vertices;         // counter-clockwise from outside; the origin is the last
    std::array<Index, 3> neighbours;       // neighbours[i] across the edge v[i] v[i+1]
    Index epoch;                           // of the insertion that last looked here
    bool visible;                          // from the point of that insertion
    bool lateral;                          // holds the origin
    bool spare;                            // no part of the hull; waits to be used again
  };
  struct HorizonEdge {
    Index from, to, outer;
  };

  StarHull(double extent, std::size_t expected_size);

  [[nodiscard]] Facet facet(Index a, Index b, Index c) const;
  [[nodiscard]] Sign height(const Facet& f, const Point& p) const;
  [[nodiscard]] Sign side(const Facet& f, std::size_t i, const Point& p) const;
  [[nodiscard]] std::optional<Index> walk(const Point& p);
  [[nodiscard]] std::span<const Index> facets_around(Index start, const Point& p);
  [[nodiscard]] std::span<const Index> star_of(Index start, std::size_t corner, const Point& p);
  [[nodiscard]] Insertion insert_above(Index visible_facet, const Point& p);

  std::vector<Point> points_;  // [0] is the origin
  std::vector<Facet> facets_;
  std::vector<Index> leaving_;  // leaving_[v]: the new facet whose horizon edge starts in v
  std::vector<Index> stack_, visible_, around_, spare_;
  std::vector<HorizonEdge> horizon_;
  double extent_;
  double side_error_;  // of sides[i].dot(p), whatever the facet and the point
  Index last_ = 0;     // where the last walk ended
  Index epoch_ = 0;
};

}  // namespace vantage::hpr
