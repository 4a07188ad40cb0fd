#include "turned_octree.hpp"

#include <Eigen/Geometry>
#include <algorithm>
#include <array>
#include <cmath>
#include <limits>

namespace vantage::hpr {
namespace {

// Turned leaves and nodes are kept until they take this much room: 1.6 MB each.
constexpr std::size_t kMostTurned = 200'000, kMostChildren = 4'000;

}  // namespace

TurnedOctree::TurnedOctree(const PointOctree& octree)
    : octree_(octree), looked_at_(octree.nodes().size()) {
  turned_.reserve(kMostTurned + 10'000);
  children_.reserve(kMostChildren + 1'000);
}

void TurnedOctree::look_from(const Eye& eye, double slack) {
  eye_ = eye;
  slack_ = slack;
  forget();
}

void TurnedOctree::forget() {
  ++stamp_;
  turned_.clear();
  children_.clear();
}

PointRef TurnedOctree::support(const Eigen::Vector3d& direction, const Point& p, Index own_leaf) {
  if (turned_.size() > kMostTurned || children_.size() > kMostChildren) forget();
  double floor = direction.dot(p) - kRounding * p.lpNorm<1>();
  PointRef farthest{PointOctree::kNone, 0};
  const auto take = [&](const PointRef& other, double height) {
    if (eye_.turned(octree_.points()[other.position]) == p) return;
    floor = height;
    farthest = other;
  };
  const auto found = [&] { return farthest.position != PointOctree::kNone; };
  stack_.assign(1, {std::numeric_limits<double>::infinity(), own_leaf});
  for (Index at = own_leaf; !found();) {
    visit_beyond(direction, floor, take, found);
    const Index parent = octree_.nodes()[at].parent;
    if (parent == PointOctree::kNone) break;
    push_children(parent, at, direction, floor);
    at = parent;
  }
  return farthest;
}

std::vector<PointRef> TurnedOctree::as_far_as(const Eigen::Vector3d& direction, const Point& p) {
  double floor = direction.dot(p) - kRounding * p.lpNorm<1>();
  std::vector<PointRef> found;
  stack_.assign(1, {std::numeric_limits<double>::infinity(), 0});
  visit_beyond(
      direction, floor, [&](const PointRef& other, double) { found.push_back(other); },
      [] { return false; });
  return found;
}

// Visits points that may reach farther than `floor` in a direction, a unit vector, in the nodes on
// the stack, until it is enough after a leaf. `visit` may raise the floor, and gets a bound on how
// far the point reaches.
template <class Visit, class Enough>
void TurnedOctree::visit_beyond(const Eigen::Vector3d& direction, double& floor, const Visit& visit,
                                const Enough& enough) {
  while (!stack_.empty()) {
    const auto [far, at] = stack_.back();
    stack_.pop_back();
    if (far < floor) continue;
    const PointOctree::Node& node = octree_.nodes()[at];
    if (!node.is_leaf()) {
      push_children(at, PointOctree::kNone, direction, floor);
      continue;
    }
    const TurnedLeaf leaf = turned_leaf(at);
    const auto height = [&](Index k) {
      return direction.x() * leaf.x[k] + direction.y() * leaf.y[k] + direction.z() * leaf.z[k] +
             leaf.rounding;
    };
    bool any = false;
    for (Index k = 0; k < node.size(); ++k) any |= height(k) >= floor;
    if (!any) continue;
    for (Index k = 0; k < node.size(); ++k) {
      if (height(k) >= floor) visit(PointRef{node.first + k, at}, height(k));
    }
    if (enough()) return;
  }
}

// Puts the children but one that may reach farther than `floor` on the stack, the farthest on top.
void TurnedOctree::push_children(Index parent, Index but, const Eigen::Vector3d& direction,
                                 double floor) {
  const Children& c = children(parent);
  std::array<double, 8> reach;
  for (std::size_t k = 0; k < 8; ++k) {
    const double cosine = direction.x() * c.x[k] + direction.y() * c.y[k] + direction.z() * c.z[k];
    const double sine = std::sqrt(std::max(0.0, 1.0 - cosine * cosine));
    const double slanted = cosine * c.cosine[k] + sine * c.sine[k] + kRounding;
    reach[k] = c.length[k] * (cosine >= c.cosine[k] ? 1.0 : slanted);
  }
  const PointOctree::Node& node = octree_.nodes()[parent];
  const auto before = static_cast<std::ptrdiff_t>(stack_.size());
  for (Index k = 0; k < node.children_last - node.children_first; ++k) {
    const Index child = node.children_first + k;
    if (child != but && reach[k] >= floor) stack_.emplace_back(reach[k], child);
  }
  std::sort(stack_.begin() + before, stack_.end());
}

const TurnedOctree::Children& TurnedOctree::children(Index parent) {
  LookedAt& looked_at = looked_at_[parent];
  if (looked_at.stamp != stamp_) {
    looked_at = {stamp_, static_cast<std::uint32_t>(children_.size())};
    Children& c = children_.emplace_back();
    const PointOctree::Node& node = octree_.nodes()[parent];
    for (Index k = 0; k < 8; ++k) {
      c.x[k] = c.y[k] = c.z[k] = c.sine[k] = 0.0;
      c.cosine[k] = -1.0;
      c.length[k] = -std::numeric_limits<double>::infinity();
      if (node.children_first + k >= node.children_last) continue;
      const Sighting s = Sighting::of(octree_.nodes()[node.children_first + k], octree_.origin(),
                                      eye_.viewpoint(), slack_);
      if (s.nearest > eye_.settings().max_range) continue;
      c.length[k] = eye_.turned_length(s.nearest) * (1.0 + kRounding);
      if (!(s.radius < s.distance)) continue;
      const Eigen::Vector3d toward = s.centre / s.distance;
      c.x[k] = toward.x();
      c.y[k] = toward.y();
      c.z[k] = toward.z();
      c.sine[k] = s.radius / s.distance;
      c.cosine[k] = std::sqrt(1.0 - c.sine[k] * c.sine[k]);
    }
  }
  return children_[looked_at.place];
}

TurnedOctree::TurnedLeaf TurnedOctree::turned_leaf(Index leaf) {
  const PointOctree::Node& node = octree_.nodes()[leaf];
  const std::size_t size = node.size();
  LookedAt& looked_at = looked_at_[leaf];
  if (looked_at.stamp != stamp_) {
    looked_at = {stamp_, static_cast<std::uint32_t>(turned_.size())};
    turned_.resize(turned_.size() + 1 + 3 * size);
    double* const x = turned_.data() + looked_at.place + 1;
    double longest = 0.0;
    for (std::size_t k = 0; k < size; ++k) {
      const Point p = eye_.relative(octree_.points()[node.first + k]);
      const bool takes_part = eye_.takes_part(p.squaredNorm());
      const Point t = takes_part ? eye_.turned(p, p.norm())
                                 : Point::Constant(std::numeric_limits<double>::quiet_NaN());
      x[k] = t.x();
      x[size + k] = t.y();
      x[2 * size + k] = t.z();
      if (takes_part) longest = std::max(longest, t.lpNorm<1>());
    }
    x[-1] = kRounding * longest;
  }
  const double* const block = turned_.data() + looked_at.place;
  return {.rounding = block[0], .x = block + 1, .y = block + 1 + size, .z = block + 1 + 2 * size};
}

}  // namespace vantage::hpr
