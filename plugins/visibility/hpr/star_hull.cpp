#include "star_hull.hpp"

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <limits>
#include <utility>

namespace vantage::hpr {
namespace {

// A determinant of differences goes through at most 8 roundings of half an epsilon (difference,
// two products, a difference, a product, two sums); twice that bounds also the products of errors.
constexpr double kDeterminantError = 8.0 * std::numeric_limits<double>::epsilon();

// A walk takes a few steps on average; one longer than the hull has facets is given up.
constexpr std::size_t kSpareSteps = 1000;

// The sum of the magnitudes in each component of the cross product a x b.
Eigen::Vector3d cross_magnitude(const Eigen::Vector3d& a, const Eigen::Vector3d& b) {
  const Eigen::Vector3d p = a.cwiseAbs(), q = b.cwiseAbs();
  return {p.y() * q.z() + p.z() * q.y(), p.z() * q.x() + p.x() * q.z(),
          p.x() * q.y() + p.y() * q.x()};
}

}  // namespace

StarHull::StarHull(double extent, std::size_t expected_size)
    : extent_(extent), side_error_(6.0 * kDeterminantError * extent * extent * extent) {
  points_.reserve(expected_size + 4);
  leaving_.reserve(expected_size + 4);
  facets_.reserve(2 * expected_size + 8);
}

std::optional<StarHull> StarHull::from(const Point& a, const Point& b, const Point& c,
                                       double extent, std::size_t expected_size) {
  StarHull hull(extent, expected_size);
  hull.points_ = {Point::Zero(), a, b, c};
  hull.leaving_.resize(4);
  Index u = 1, v = 2;
  const Sign orientation = hull.height(hull.facet(1, 2, 3), Point::Zero());
  if (orientation == Sign::uncertain) return std::nullopt;
  if (orientation == Sign::positive) std::swap(u, v);

  hull.facets_ = {hull.facet(u, v, 3), hull.facet(v, u, 0), hull.facet(3, v, 0),
                  hull.facet(u, 3, 0)};
  hull.facets_[0].neighbours = {1, 2, 3};
  hull.facets_[1].neighbours = {0, 3, 2};
  hull.facets_[2].neighbours = {0, 1, 3};
  hull.facets_[3].neighbours = {0, 2, 1};
  return hull;
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
          .sides = {p.cross(q), q.cross(r), r.cross(p)},
          .vertices = {a, b, c},
          .neighbours = {},
          .epoch = 0,
          .visible = false,
          .lateral = lateral,
          .spare = false};
}

StarHull::Sign StarHull::height(const Facet& f, const Point& p) const {
  const Eigen::Vector3d d = p - points_[f.vertices[0]];
  const double h = f.normal.dot(d);
  const double error = f.error * d.lpNorm<1>();
  if (h > error) return Sign::positive;
  if (h < -error) return Sign::negative;
  return Sign::uncertain;
}

StarHull::Sign StarHull::side(const Facet& f, std::size_t i, const Point& p) const {
  const double coarse = f.sides[i].dot(p);
  if (coarse > side_error_) return Sign::positive;
  if (coarse < -side_error_) return Sign::negative;
  // det(a, b, p) = det(a, b - a, p - a), whose error is smaller by the distances' ratio squared.
  const Point& a = points_[f.vertices[i]];
  const Eigen::Vector3d ab = points_[f.vertices[(i + 1) % 3]] - a, ap = p - a;
  const double fine = a.cross(ab).dot(ap);
  const double error = kDeterminantError * cross_magnitude(a, ab).dot(ap.cwiseAbs());
  if (fine > error) return Sign::positive;
  if (fine < -error) return Sign::negative;
  return Sign::uncertain;
}

std::optional<StarHull::Index> StarHull::walk(const Point& p) {
  Index at = last_, from = last_;
  if (facets_[at].lateral) {
    if (side(facets_[at], 0, p) == Sign::positive) return at;
    at = facets_[at].neighbours[0];
  }
  std::uint32_t turn = 0;
  for (std::size_t steps = facets_.size() + kSpareSteps; steps > 0; --steps) {
    const Facet& f = facets_[at];
    if (f.lateral) return last_ = at;
    // Always leaving by the same edge could run in circles; a varying first choice cannot for long.
    turn = turn * 1664525U + 1013904223U;
    Index next = at;
    for (std::size_t k = 0, i = turn >> 16U; k < 3 && next == at; ++k, ++i) {
      const std::size_t edge = i % 3;
      if (f.neighbours[edge] != from && side(f, edge, p) == Sign::negative) {
        next = f.neighbours[edge];
      }
    }
    if (next == at) return last_ = at;
    from = at;
    at = next;
  }
  return std::nullopt;
}

// Facets whose cones together certainly hold p, given the one where the walk ended: usually that
// one; both beside an edge that p is too close to; all around a vertex that p is too close to.
// Empty if none of these is certain.
std::span<const StarHull::Index> StarHull::facets_around(Index start, const Point& p) {
  const Facet& f = facets_[start];
  around_.assign(1, start);
  if (f.lateral) return around_;
  std::size_t uncertain = 0, edge = 0, certain = 0;
  for (std::size_t i = 0; i < 3; ++i) {
    switch (side(f, i, p)) {
      case Sign::positive: certain = i; break;
      case Sign::negative: return {};
      case Sign::uncertain:
        ++uncertain;
        edge = i;
        break;
    }
  }
  if (uncertain == 0) return around_;
  if (uncertain == 1) {
    const Index beside = f.neighbours[edge];
    const Facet& g = facets_[beside];
    if (!g.lateral) {
      for (std::size_t i = 0; i < 3; ++i) {
        if (g.neighbours[i] != start && side(g, i, p) != Sign::positive) return {};
      }
    }
    around_.push_back(beside);
    return around_;
  }
  if (uncertain == 2) return star_of(start, (certain + 2) % 3, p);
  return {};
}

// The facets around a vertex, if p is on the inner side of all edges opposite to it: the arc from
// the vertex to p then crosses none of them, so p is in one of the cones.
std::span<const StarHull::Index> StarHull::star_of(Index start, std::size_t corner,
                                                   const Point& p) {
  const Index vertex = facets_[start].vertices[corner];
  around_.clear();
  Index at = start;
  do {
    const Facet& f = facets_[at];
    if (f.lateral) return {};
    const auto here = static_cast<std::size_t>(
        std::find(f.vertices.begin(), f.vertices.end(), vertex) - f.vertices.begin());
    if (side(f, (here + 1) % 3, p) != Sign::positive) return {};
    around_.push_back(at);
    at = f.neighbours[here];
  } while (at != start);
  return around_;
}

StarHull::Insertion StarHull::insert(const Point& p) {
  const std::optional<Index> end = walk(p);
  if (!end) return {Verdict::undecided, 0};
  for (const Index v : facets_[*end].vertices) {
    if (v != 0 && points_[v] == p) return {Verdict::coincident, v};
  }
  bool undecided = true;
  for (const Index f : facets_around(*end, p)) {
    undecided = false;
    switch (height(facets_[f], p)) {
      case Sign::positive: return insert_above(f, p);
      case Sign::negative: break;
      case Sign::uncertain: return {Verdict::undecided, 0};
    }
  }
  if (undecided || facets_[*end].lateral) return {Verdict::undecided, 0};
  return {Verdict::inside, 0};
}

// The facets that p sees are connected; they make way for the cone of p over their rim.
StarHull::Insertion StarHull::insert_above(Index visible_facet, const Point& p) {
  ++epoch_;
  stack_.assign(1, visible_facet);
  visible_.clear();
  horizon_.clear();
  facets_[visible_facet].epoch = epoch_;
  facets_[visible_facet].visible = true;
  while (!stack_.empty()) {
    const Index at = stack_.back();
    stack_.pop_back();
    visible_.push_back(at);
    for (std::size_t i = 0; i < 3; ++i) {
      const Index beside = facets_[at].neighbours[i];
      Facet& g = facets_[beside];
      if (g.epoch != epoch_) {
        const Sign sign = height(g, p);
        if (sign == Sign::uncertain) return {Verdict::undecided, 0};
        g.epoch = epoch_;
        g.visible = sign == Sign::positive;
        if (g.visible) stack_.push_back(beside);
      }
      if (!g.visible) {
        const auto& v = facets_[at].vertices;
        horizon_.push_back({.from = v[i], .to = v[(i + 1) % 3], .outer = beside});
      }
    }
  }

  const auto vertex = static_cast<Index>(points_.size());
  points_.push_back(p);
  leaving_.push_back(0);
  spare_.insert(spare_.end(), visible_.begin(), visible_.end());
  for (const Index f : visible_) facets_[f].spare = true;
  for (const HorizonEdge& edge : horizon_) {
    if (spare_.empty()) {
      spare_.push_back(static_cast<Index>(facets_.size()));
      facets_.emplace_back();
    }
    const Index slot = spare_.back();
    spare_.pop_back();
    facets_[slot] = facet(edge.from, edge.to, vertex);
    leaving_[edge.from] = slot;
  }
  const auto edge_of = [this](const Facet& f, Index from) {
    return static_cast<std::size_t>(std::find(f.vertices.begin(), f.vertices.end(), from) -
                                    f.vertices.begin());
  };
  for (const HorizonEdge& edge : horizon_) {
    const Index inner = leaving_[edge.from], next = leaving_[edge.to];
    Facet& f = facets_[inner];
    Facet& g = facets_[next];
    Facet& outer = facets_[edge.outer];
    f.neighbours[edge_of(f, edge.from)] = edge.outer;
    outer.neighbours[edge_of(outer, edge.to)] = inner;
    f.neighbours[edge_of(f, edge.to)] = next;
    g.neighbours[edge_of(g, vertex)] = inner;
  }
  last_ = leaving_[horizon_.front().from];
  return {Verdict::inserted, vertex};
}

double StarHull::reach(const Eigen::Vector3d& u) {
  const Point far = extent_ * u;
  const std::optional<Index> end = walk(far);
  if (!end || facets_[*end].lateral) return 0.0;
  const Facet& f = facets_[*end];
  for (std::size_t i = 0; i < 3; ++i) {
    if (side(f, i, far) != Sign::positive) return 0.0;
  }
  const Point& a = points_[f.vertices[0]];
  const double offset = f.normal.dot(a) - f.error * a.lpNorm<1>();
  const double slope = f.normal.dot(u) + f.error * u.lpNorm<1>();
  return offset > 0.0 && slope > 0.0 ? offset / slope : 0.0;
}

bool StarHull::holds_ball(const Point& p, double radius) {
  const std::optional<Index> end = walk(p);
  if (!end || facets_[*end].lateral) return false;
  const Facet& f = facets_[*end];
  if (-f.normal.dot(p - points_[f.vertices[0]]) < radius * f.normal.norm()) return false;
  for (std::size_t i = 0; i < 3; ++i) {
    const Point& a = points_[f.vertices[i]];
    const Eigen::Vector3d normal = a.cross(points_[f.vertices[(i + 1) % 3]] - a);
    if (normal.dot(p - a) < radius * normal.norm()) return false;
  }
  return true;
}

std::vector<std::uint32_t> StarHull::vertices() const {
  std::vector<std::uint8_t> on_hull(points_.size(), 0);
  for (const Facet& f : facets_) {
    if (f.spare) continue;
    for (const Index v : f.vertices) on_hull[v] = 1;
  }
  std::vector<std::uint32_t> result;
  for (Index v = 1; v < on_hull.size(); ++v) {
    if (on_hull[v] != 0) result.push_back(v);
  }
  return result;
}

}  // namespace vantage::hpr
