#pragma once

#include <algorithm>
#include <cstdint>
#include <utility>
#include <vector>

#include "eye.hpp"
#include "point_octree.hpp"

namespace vantage::hpr {

// Covers the rounding of distances, lengths and scalar products, relative to the largest of them.
inline constexpr double kRounding = 1e-13;

/// A point of an octree, and the leaf that it is in.
struct PointRef {
  PointOctree::Index position, leaf;
};

/// A node's box as it looks from the viewpoint [m].
struct Sighting {
  Eigen::Vector3d low, high, centre;
  double distance, radius, nearest;  ///< of the centre; of a ball about it; of the box

  /// @param slack  covers the rounding of any distance to a box [m]
  [[nodiscard]] static Sighting of(const PointOctree::Node& node, const Point& origin,
                                   const Point& viewpoint, double slack);
};

/// An octree's points after turning: how far they reach in a direction. What has been turned is
/// kept until the viewpoint changes, or until it takes too much room. Not for several threads at
/// once.
class TurnedOctree {
 public:
  using Index = PointOctree::Index;

  /// @param octree  borrowed
  explicit TurnedOctree(const PointOctree& octree);

  /// @param slack  covers the rounding of any distance to a box [m]
  void look_from(const Eye& eye, double slack);

  /// A point other than p that may reach as far as p in a direction, a unit vector, found by going
  /// outward from p's leaf: what occludes a point usually is close to it. The first such leaf is
  /// enough; of its points the one that reaches farthest.
  /// @return  with the position kNone if there is none
  [[nodiscard]] PointRef support(const Eigen::Vector3d& direction, const Point& turned,
                                 Index own_leaf);

  /// All points that may reach as far as p in a direction, a unit vector.
  [[nodiscard]] std::vector<PointRef> as_far_as(const Eigen::Vector3d& direction,
                                                const Point& turned);

 private:
  // A node's children, ready to be asked how far they reach in a direction.
  struct Children {
    double x[8], y[8], z[8];    // unit vectors to their centres
    double sine[8], cosine[8];  // of the angle that they fill; cosine -1: all directions
    double length[8];           // of their longest turned point
  };
  // The turned points of a leaf, NaN for those that take no part, and a bound on how much rounding
  // may take from their scalar products with a unit vector.
  struct TurnedLeaf {
    double rounding;
    const double *x, *y, *z;
  };
  // Where a node's part of `turned_` or of `children_` begins, if the stamp is this viewpoint's.
  struct LookedAt {
    std::uint32_t stamp = 0, place = 0;
  };

  void forget();
  template <class Visit, class Enough>
  void visit_beyond(const Eigen::Vector3d& direction, double& floor, const Visit& visit,
                    const Enough& enough);
  void push_children(Index parent, Index but, const Eigen::Vector3d& direction, double floor);
  [[nodiscard]] TurnedLeaf turned_leaf(Index leaf);
  [[nodiscard]] const Children& children(Index node);

  const PointOctree& octree_;
  Eye eye_;
  double slack_ = 0.0;

  std::vector<double> turned_;       // the leaves looked at from here, one after the other
  std::vector<Children> children_;   // of the inner nodes looked at from here
  std::vector<LookedAt> looked_at_;  // of each node
  std::uint32_t stamp_ = 0;
  std::vector<std::pair<double, Index>> stack_;
};

inline Sighting Sighting::of(const PointOctree::Node& node, const Point& origin,
                             const Point& viewpoint, double slack) {
  const Eigen::Vector3d offset = origin - viewpoint;
  const Eigen::Vector3d low = node.min.cast<double>() + offset;
  const Eigen::Vector3d high = node.max.cast<double>() + offset;
  const Eigen::Vector3d centre = 0.5 * (low + high);
  const Eigen::Vector3d gap = low.cwiseMax(-high).cwiseMax(0.0);
  return {.low = low,
          .high = high,
          .centre = centre,
          .distance = centre.norm(),
          .radius = 0.5 * (high - low).norm() + slack,
          .nearest = std::max(0.0, gap.norm() - slack)};
}

}  // namespace vantage::hpr
