#include "star_hull.hpp"

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <limits>
#include <utility>

namespace vantage::hpr {
namespace {

// A determinant of differences takes at most 8 roundings of half an epsilon (a difference, two
// products, a difference, a product, two sums). Twice that also bounds the products of errors.
constexpr double kDeterminantError = 8.0 * std::numeric_limits<double>::epsilon();

// Larger than the relative rounding error of computations with cones.
constexpr double kMargin = 1e-12;

// The sum of the magnitudes in each component of the cross product a x b.
Eigen::Vector3d cross_magnitude(const Eigen::Vector3d& a, const Eigen::Vector3d& b) {
  const Eigen::Vector3d p = a.cwiseAbs(), q = b.cwiseAbs();
  return {p.y() * q.z() + p.z() * q.y(), p.z() * q.x() + p.x() * q.z(),
          p.x() * q.y() + p.y() * q.x()};
}

// The next edge after each edge of a triangle.
constexpr std::array<std::uint32_t, 3> kNext{1, 2, 0};

}  // namespace

bool StarHull::start(const Point& a, const Point& b, const Point& c) {
  const Sign orientation = sign_of_triple(a, b, c);
  if (orientation == Sign::zero) return false;
  points_ = {Point::Zero(), a, b, c};
  max_squared_ = std::max({a.squaredNorm(), b.squaredNorm(), c.squaredNorm()});
  leaving_.assign(4, edge(0, 0));
  facet_of_.assign(4, 0);
  spare_.clear();
  last_ = epoch_ = 0;
  const Index u = orientation == Sign::positive ? 1 : 2, v = 3 - u;
  facets_ = {facet(u, v, 3), facet(v, u, 0), facet(3, v, 0), facet(u, 3, 0)};
  facets_[0].neighbours = {edge(1, 0), edge(2, 0), edge(3, 0)};
  facets_[1].neighbours = {edge(0, 0), edge(3, 2), edge(2, 1)};
  facets_[2].neighbours = {edge(0, 1), edge(1, 2), edge(3, 1)};
  facets_[3].neighbours = {edge(0, 2), edge(2, 2), edge(1, 1)};
  facet_of_[0] = 1;
  return true;
}

StarHull::Facet StarHull::facet(Index a, Index b, Index c) const {
  const bool lateral = a == 0 || b == 0 || c == 0;
  while (lateral && c != 0) {
    const Index first = a;
    a = b;
    b = c;
    c = first;
  }
  const Point &p = points_[a], &q = points_[b], &r = points_[c];
  const Eigen::Vector3d pq = q - p, pr = r - p;
  return {.normal = pq.cross(pr),
          .error = kDeterminantError * cross_magnitude(pq, pr).maxCoeff(),
          .vertices = {a, b, c},
          .neighbours = {},
          .epoch = 0,
          .visible = false,
          .lateral = lateral,
          .spare = false};
}

// The sign of the height; zero if rounding could hide the sign.
Sign StarHull::plain_height(const Facet& f, const Point& p) const {
  const Eigen::Vector3d d = p - points_[f.vertices[0]];
  const double h = f.normal.dot(d);
  const double error = f.error * d.lpNorm<1>();
  return h > error ? Sign::positive : (h < -error ? Sign::negative : Sign::zero);
}

Sign StarHull::height(const Facet& f, const Point& p) const {
  const Sign plain = plain_height(f, p);
  if (plain != Sign::zero) return plain;
  return sign_of_volume(points_[f.vertices[0]], points_[f.vertices[1]], points_[f.vertices[2]], p);
}

double StarHull::coarse_error(const Point& p) const {
  return 6.0 * kDeterminantError * max_squared_ * p.lpNorm<Eigen::Infinity>();
}

Sign StarHull::side(const Facet& f, std::size_t i, const Point& p, double coarse_error) const {
  const Point& a = points_[f.vertices[i]];
  const Point& b = points_[f.vertices[(i + 1) % 3]];
  const double coarse = a.cross(b).dot(p);
  if (coarse > coarse_error) return Sign::positive;
  if (coarse < -coarse_error) return Sign::negative;
  if (p == a || p == b) return Sign::zero;
  // det(a, b, p) = det(a, b - a, p - a), whose error is smaller by the square of the ratio of the
  // distances.
  const Eigen::Vector3d ab = b - a, ap = p - a;
  const double fine = a.cross(ab).dot(ap);
  const double error = kDeterminantError * cross_magnitude(a, ab).dot(ap.cwiseAbs());
  if (fine > error) return Sign::positive;
  if (fine < -error) return Sign::negative;
  return sign_of_triple(a, b, p);
}

// Whether p, in the plane of a lateral facet, is on the line of its edge or on the side of it away
// from the origin. Moving the origin outward puts that facet below p.
bool StarHull::beyond_edge(const Facet& lateral, const Point& p) const {
  const Point &a = points_[lateral.vertices[0]], &b = points_[lateral.vertices[1]];
  for (Eigen::Index axis = 0; axis < 3; ++axis) {
    const Eigen::Vector2d u = without(axis, a), v = without(axis, b);
    const Sign of_origin = sign_of_turn(u, v, Eigen::Vector2d::Zero());
    if (of_origin == Sign::zero) continue;  // seen edge-on along this axis
    return sign_of_turn(u, v, without(axis, p)) != of_origin;
  }
  return false;
}

bool StarHull::seen_from(const Facet& f, const Point& p) const {
  switch (height(f, p)) {
    case Sign::positive: return true;
    case Sign::negative: return false;
    case Sign::zero: return !f.lateral || beyond_edge(f, p);
  }
  return false;
}

// Ends at a facet whose cone contains p, or at a lateral facet that p is strictly above. Every step
// leaves through an edge that strictly separates. The cones over the facets of a convex hull are a
// regular triangulation, in which such steps never form a cycle (Edelsbrunner 1990).
StarHull::Index StarHull::walk(const Point& p) {
  const double error = coarse_error(p);
  Index at = last_;
  if (facets_[at].lateral) {
    if (side(facets_[at], 0, p, error) == Sign::positive) return at;
    at = facets_[at].neighbours[0].facet();
  }
  const bool beyond = side(facets_[at], 0, p, error) == Sign::negative;
  return last_ = walk_through(beyond ? facets_[at].neighbours[0] : edge(at, 0), p, error);
}

// Continues the walk in the facet entered through an edge that p is not beyond. The other two edges
// meet in the vertex opposite to it.
StarHull::Index StarHull::walk_through(Edge entry, const Point& p, double error) const {
  while (true) {
    const Index at = entry.facet();
    const Facet& f = facets_[at];
    if (f.lateral) return at;
    const Index first = entry.place(), next = kNext[first], last = kNext[next];
    // det(u, c, p) = -u . (p x c) and det(c, v, p) = v . (p x c)
    const Eigen::Vector3d turned = p.cross(points_[f.vertices[last]]);
    const double of_next = -turned.dot(points_[f.vertices[next]]);
    const double of_last = turned.dot(points_[f.vertices[first]]);
    // If p is beyond an edge, the walk crosses the edge that p is farther beyond.
    Index exit = of_last < of_next ? last : next;
    if (const double farther = std::min(of_next, of_last); !(farther < -error)) {
      if (farther > error) return at;
      if (side(f, exit, p, error) != Sign::negative) {
        exit = exit == next ? last : next;
        if (std::max(of_next, of_last) > error || side(f, exit, p, error) != Sign::negative) {
          return at;
        }
      }
    }
    entry = f.neighbours[exit];
  }
}

StarHull::Location StarHull::locate(const Point& p) {
  const Index end = walk(p);
  const Facet& f = facets_[end];
  if (f.lateral) return {Place::outside, end};
  const Sign plain = plain_height(f, p);
  if (plain != Sign::zero) return {plain == Sign::positive ? Place::outside : Place::inside, end};
  for (const Index v : f.vertices) {
    if (points_[v] == p) return {Place::vertex, v};
  }
  return {height(f, p) == Sign::positive ? Place::outside : Place::inside, end};
}

double StarHull::reach(const Eigen::Vector3d& u) {
  const Facet& f = facets_[walk(u)];
  if (f.lateral) return 0.0;
  const Point& a = points_[f.vertices[0]];
  const double offset = f.normal.dot(a) - f.error * a.lpNorm<1>();
  const double slope = f.normal.dot(u) + f.error * u.lpNorm<1>();
  return offset > 0.0 && slope > 0.0 ? offset / slope : 0.0;
}

// Whether the plane of a facet is certainly above the whole cone.
bool StarHull::is_above(const Facet& f, const Cone& cone) const {
  const Point& a = points_[f.vertices[0]];
  const double along = f.normal.dot(cone.axis), squared_length = f.normal.squaredNorm();
  const double across = std::sqrt(std::max(0.0, squared_length - along * along));
  const bool points_along = along > 0.0 && across * cone.cosine <= along * cone.sine;
  const double reach =
      points_along ? std::sqrt(squared_length) : along * cone.cosine + across * cone.sine;
  const double rounding = f.error * (a.lpNorm<1>() + 2.0 * cone.length);
  return cone.length * reach * (1.0 + kMargin) + rounding < f.normal.dot(a);
}

// The cone is inside if it is below the plane of every facet that it is behind, in whole or in
// part. False if there are too many such facets, or if part of the cone is not behind the hull.
bool StarHull::surely_holds(const Cone& cone) {
  constexpr std::size_t kMostFacets = 48;
  const double squared_sine = cone.sine * cone.sine * (1.0 + kMargin);
  ++epoch_;
  around_.assign(1, walk(cone.axis));
  facets_[around_[0]].epoch = epoch_;
  for (std::size_t k = 0; k < around_.size(); ++k) {
    const Facet& f = facets_[around_[k]];
    if (f.lateral || !is_above(f, cone)) return false;
    for (std::size_t i = 0; i < 3; ++i) {
      const Index number = f.neighbours[i].facet();
      Facet& beside = facets_[number];
      if (beside.epoch == epoch_) continue;
      const Eigen::Vector3d side = points_[f.vertices[i]].cross(points_[f.vertices[kNext[i]]]);
      const double inward = side.dot(cone.axis);
      if (inward > 0.0 && inward * inward > squared_sine * side.squaredNorm()) continue;
      if (around_.size() == kMostFacets) return false;
      beside.epoch = epoch_;
      around_.push_back(number);
    }
  }
  return true;
}

bool StarHull::above(Index facet, const Point& p) const {
  return height(facets_[facet], p) == Sign::positive;
}

// The facets that p sees are connected. Their rim goes to horizon_, edge by edge.
void StarHull::find_horizon(const Point& p, Index facet) {
  ++epoch_;
  stack_.assign(1, facet);
  visible_.clear();
  horizon_.clear();
  facets_[facet].epoch = epoch_;
  facets_[facet].visible = true;
  while (!stack_.empty()) {
    const Index at = stack_.back();
    stack_.pop_back();
    visible_.push_back(at);
    for (std::size_t i = 0; i < 3; ++i) {
      const Edge across = facets_[at].neighbours[i];
      const Index beside = across.facet();
      Facet& g = facets_[beside];
      if (g.epoch != epoch_) {
        g.epoch = epoch_;
        g.visible = seen_from(g, p);
        if (g.visible) stack_.push_back(beside);
      }
      if (!g.visible) {
        const auto& v = facets_[at].vertices;
        horizon_.push_back({.from = v[i], .to = v[(i + 1) % 3], .outer = across});
      }
    }
  }
}

StarHull::Index StarHull::add(const Point& p, Location outside) {
  find_horizon(p, outside.at);
  const auto vertex = static_cast<Index>(points_.size());
  points_.push_back(p);
  max_squared_ = std::max(max_squared_, p.squaredNorm());
  leaving_.push_back(edge(0, 0));
  facet_of_.push_back(0);
  spare_.insert(spare_.end(), visible_.begin(), visible_.end());
  for (const Index f : visible_) facets_[f].spare = true;
  for (const HorizonEdge& rim : horizon_) {
    if (spare_.empty()) {
      spare_.push_back(static_cast<Index>(facets_.size()));
      if (facets_.size() == facets_.capacity())
        facets_.reserve(facets_.size() + facets_.size() / 4);
      facets_.emplace_back();
    }
    const Index slot = spare_.back();
    spare_.pop_back();
    facets_[slot] = facet(rim.from, rim.to, vertex);
    // Where `facet` has the edge.
    const Index place = rim.from == 0 ? 2 : (rim.to == 0 ? 1 : 0);
    facets_[slot].neighbours[place] = rim.outer;
    facets_[rim.outer.facet()].neighbours[rim.outer.place()] = edge(slot, place);
    leaving_[rim.from] = edge(slot, place);
    facet_of_[rim.from] = slot;
  }
  for (const HorizonEdge& rim : horizon_) {
    const Edge here = leaving_[rim.from], next = leaving_[rim.to];
    const Index after = kNext[here.place()], before = kNext[kNext[next.place()]];
    facets_[here.facet()].neighbours[after] = edge(next.facet(), before);
    facets_[next.facet()].neighbours[before] = edge(here.facet(), after);
  }
  last_ = facet_of_[vertex] = leaving_[horizon_.front().from].facet();
  return vertex;
}

std::span<const StarHull::Index> StarHull::facets_about(Index vertex) {
  around_.clear();
  Index at = facet_of_[vertex];
  do {
    around_.push_back(at);
    const Facet& f = facets_[at];
    const auto here = static_cast<std::size_t>(
        std::find(f.vertices.begin(), f.vertices.end(), vertex) - f.vertices.begin());
    at = f.neighbours[here].facet();
  } while (at != around_.front());
  return around_;
}

Eigen::Vector3d StarHull::normal_at(Index vertex) {
  Eigen::Vector3d sum = Eigen::Vector3d::Zero();
  for (const Index f : facets_about(vertex)) sum += facets_[f].normal.normalized();
  return sum.normalized();
}

bool StarHull::is_on_hull(Index vertex) const {
  const Facet& f = facets_[facet_of_[vertex]];
  return !f.spare && std::find(f.vertices.begin(), f.vertices.end(), vertex) != f.vertices.end();
}

std::vector<StarHull::Index> StarHull::vertices() const {
  std::vector<Index> result;
  for (Index v = 1; v < points_.size(); ++v) {
    if (is_on_hull(v)) result.push_back(v);
  }
  return result;
}

}  // namespace vantage::hpr
