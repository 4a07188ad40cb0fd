#pragma once

#include <Eigen/Core>
#include <array>
#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

#include "exact_sign.hpp"
#include "vantage/point_cloud.hpp"

namespace vantage::hpr {

/// The convex hull of the origin and of points that are added one after the other. It is exact for
/// the given numbers: every decision is the sign of a determinant. The sign is computed in double,
/// and without rounding if the rounding error could hide it (Shewchuk 1997, Sec. 4.3).
///
/// Degenerate cases follow one rule, a symbolic perturbation: the origin is treated as if moved
/// outward by an infinitesimal length, and each added point as if moved by a far smaller one. So a
/// point in a facet, on an edge or at a vertex is inside; no vertex of the hull lies between
/// others; and the origin is always a vertex or inside, never in the middle of a facet.
///
/// The hull is star-shaped around the origin. To locate a point, a walk crosses the cones that the
/// origin forms with the facets. If the origin itself is on the hull, the facets that contain it
/// (`lateral` ones) end the walk.
class StarHull {
 public:
  using Index = std::uint32_t;
  enum class Place : std::uint8_t {
    inside,   ///< in the hull or on it, but not at a vertex
    vertex,   ///< at exactly the place of a vertex
    outside,  ///< strictly
  };
  struct Location {
    Place place;
    Index at;  ///< `vertex`: its number; `outside`: a facet that the point is strictly above
  };

  /// Starts again with the tetrahedron of the origin and three points, vertices 1, 2, 3; the origin
  /// is vertex 0. Returns false if the tetrahedron is flat; the hull must then not be used.
  [[nodiscard]] bool start(const Point& a, const Point& b, const Point& c);

  /// Cheapest if consecutive points have similar directions.
  [[nodiscard]] Location locate(const Point& p);

  /// Adds a point that was just located outside. Returns its number; numbers count up.
  Index add(const Point& p, Location outside);

  /// A length that is not larger than how far the hull reaches from the origin in a direction, and
  /// usually equal to it; 0 if that is not clear.
  /// @param u  unit vector
  [[nodiscard]] double reach(const Eigen::Vector3d& u);

  /// All points within an angle of an axis and within a length of the origin.
  struct Cone {
    Eigen::Vector3d axis;  // unit vector
    double sine, cosine;   // of the angle, < 90 degrees
    double length;
  };
  /// Whether all points of the cone are certainly inside; false if that is not clear.
  [[nodiscard]] bool surely_holds(const Cone& cone);

  /// Outward normal of a facet: any length, rounded.
  [[nodiscard]] const Eigen::Vector3d& normal(Index facet) const { return facets_[facet].normal; }
  /// A direction in which the hull reaches farthest at that vertex, rounded; a unit vector if there
  /// is one.
  /// Precondition: the vertex is on the hull.
  [[nodiscard]] Eigen::Vector3d normal_at(Index vertex);
  /// The facets around a vertex on the hull, valid until the next call.
  [[nodiscard]] std::span<const Index> facets_about(Index vertex);

  /// Whether p is strictly above a facet.
  [[nodiscard]] bool above(Index facet, const Point& p) const;

  /// Vertices that are on the hull now, strictly ascending, without the origin.
  [[nodiscard]] std::vector<Index> vertices() const;
  [[nodiscard]] bool is_on_hull(Index vertex) const;
  [[nodiscard]] std::size_t points() const { return points_.size(); }

 private:
  // An edge v[i] v[i+1] of a facet, in the direction of that facet.
  struct Edge {
    Index number;  // 4 facet + i

    [[nodiscard]] Index facet() const { return number >> 2U; }
    [[nodiscard]] Index place() const { return number & 3U; }
  };
  [[nodiscard]] static Edge edge(Index facet, Index place) { return {(facet << 2U) | place}; }
  struct alignas(64) Facet {
    Eigen::Vector3d normal;          // outward, (v1 - v0) x (v2 - v0)
    double error;                    // of normal.(p - v0), for |p - v0|_1 = 1
    std::array<Index, 3> vertices;   // counter-clockwise from outside; the origin is last
    std::array<Edge, 3> neighbours;  // neighbours[i] across the edge v[i] v[i+1]
    Index epoch;                     // of the search that last looked here
    bool visible;                    // from the point of that search
    bool lateral;                    // holds the origin
    bool spare;                      // not part of the hull; can be used again
  };
  struct HorizonEdge {
    Index from, to;
    Edge outer;
  };

  [[nodiscard]] Facet facet(Index a, Index b, Index c) const;
  [[nodiscard]] Sign plain_height(const Facet& f, const Point& p) const;
  [[nodiscard]] Sign height(const Facet& f, const Point& p) const;
  /// The side of the plane through the origin and an edge on which p lies; positive on the facet's
  /// side.
  [[nodiscard]] Sign side(const Facet& f, std::size_t i, const Point& p, double coarse_error) const;
  [[nodiscard]] double coarse_error(const Point& p) const;
  [[nodiscard]] bool beyond_edge(const Facet& lateral, const Point& p) const;
  [[nodiscard]] bool seen_from(const Facet& f, const Point& p) const;
  [[nodiscard]] Index walk(const Point& p);
  [[nodiscard]] Index walk_through(Edge entry, const Point& p, double error) const;
  void find_horizon(const Point& p, Index facet);
  [[nodiscard]] bool is_above(const Facet& f, const Cone& cone) const;

  std::vector<Point> points_;    // [0] is the origin
  std::vector<Index> facet_of_;  // for each point that is on the hull, a facet around it
  std::vector<Facet> facets_;
  std::vector<Edge> leaving_;  // leaving_[v]: the horizon edge of a new facet that starts in v
  std::vector<Index> stack_, visible_, around_, spare_;
  std::vector<HorizonEdge> horizon_;
  double max_squared_ = 0.0;  // of the added points' lengths
  Index last_ = 0;            // where the last walk ended
  Index epoch_ = 0;
};

}  // namespace vantage::hpr
