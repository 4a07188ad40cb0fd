#pragma once

#include <cstddef>
#include <cstdint>
#include <span>
#include <utility>
#include <vector>

#include "direction_bins.hpp"
#include "eye.hpp"
#include "occlusion_map.hpp"
#include "point_octree.hpp"
#include "star_hull.hpp"
#include "unknown_points.hpp"

namespace vantage::hpr {

/// Looks at the map from one viewpoint after another, and remembers what occluded last: from a
/// nearby viewpoint, nearly the same points occlude. What it sees never depends on earlier
/// viewpoints.
/// Not thread safe.
class Sight {
 public:
  using Index = PointOctree::Index;

  /// Both are borrowed.
  Sight(const PointOctree& octree, const Settings& settings);

  /// Positions of all points seen from the viewpoint, in no particular order.
  [[nodiscard]] std::vector<Index> visible_from(const Point& viewpoint);

  /// The last viewpoint.
  [[nodiscard]] const Point& viewpoint() const { return eye_.viewpoint(); }

  /// Marks the unknown points that are seen from the viewpoint, and returns their number.
  std::size_t mark_visible(const Point& viewpoint, UnknownPoints& unknown);

  /// As `mark_visible`, but by means of `visible_from`: faster if much of what is seen is unknown.
  std::size_t mark_all_visible(const Point& viewpoint, UnknownPoints& unknown);

 private:
  struct PointRef {
    Index position, leaf;
  };
  // A node's box as seen from the viewpoint [m].
  struct Sighting {
    Eigen::Vector3d low, high, centre;
    double distance, radius, nearest;  // of the centre; of a ball about it; of the box
  };
  // A node's children, in a form that quickly gives how far they reach in a direction.
  struct Children {
    double x[8], y[8], z[8];    // unit vectors to their centres
    double sine[8], cosine[8];  // of the angle that they cover; cosine -1: all directions
    double length[8];           // of their longest turned point
  };
  // The turned points of a leaf, NaN for points that take no part, and a bound on the rounding
  // error of their scalar products with a unit vector.
  struct TurnedLeaf {
    double rounding;
    const double *x, *y, *z;
  };

  // Where a node's part of `turned_` or of `children_` begins, if the stamp is that of this
  // viewpoint.
  struct LookedAt {
    std::uint32_t stamp = 0, place = 0;
  };

  void look_from(const Point& viewpoint);
  void forget_turned();
  [[nodiscard]] Point turned(Index position) const {
    return eye_.turned(octree_.points()[position]);
  }
  template <class Enter, class Visit>
  void traverse(const Enter& enter, const Visit& visit_leaf) const;
  [[nodiscard]] Sighting sighting(const PointOctree::Node& node) const;
  [[nodiscard]] StarHull::Cone cone_of(const Sighting& s) const;
  [[nodiscard]] bool surely_hidden(const Sighting& s);

  [[nodiscard]] bool start_hull();
  [[nodiscard]] bool start_hull(const std::vector<PointRef>& among);
  StarHull::Location put_in(const PointRef& ref, const Point& turned);
  void put_in_bucket(std::uint32_t bucket);
  void fill_tile(std::uint32_t tile);
  [[nodiscard]] std::vector<PointRef> representatives() const;
  [[nodiscard]] std::vector<PointRef> participants() const;
  void sort_occluders();
  void keep_occluders();
  [[nodiscard]] std::vector<PointRef> seen_refs(const Point& viewpoint);

  template <class Wanted>
  [[nodiscard]] std::span<const PointRef> doubtful(Index leaf, const Wanted& wanted);
  [[nodiscard]] bool is_visible(const PointRef& ref);
  [[nodiscard]] bool is_vertex_among_all(const PointRef& ref, const Point& turned);
  [[nodiscard]] PointRef support(const Eigen::Vector3d& direction, const Point& turned,
                                 Index own_leaf);
  template <class Visit, class Enough>
  void visit_beyond(const Eigen::Vector3d& direction, double& floor, const Visit& visit,
                    const Enough& enough);
  void push_children(Index parent, Index but, const Eigen::Vector3d& direction, double floor);
  [[nodiscard]] TurnedLeaf turned_leaf(Index leaf);
  [[nodiscard]] const Children& children(Index node);

  const PointOctree& octree_;
  Settings settings_;
  Eye eye_;
  double slack_ = 0.0;  // [m], larger than the rounding of any distance to a box

  StarHull hull_;
  OcclusionMap occlusion_;                                        // by the hull
  std::vector<PointRef> vertices_;                                // of the hull, by their number
  std::vector<std::pair<PointRef, StarHull::Index>> coincident_;  // with that vertex

  std::vector<PointRef> occluders_;          // of earlier viewpoints, bucket by bucket
  std::vector<std::uint32_t> bucket_first_;  // into occluders_, one more than the number of buckets
  std::vector<std::uint8_t> bucket_is_in_;   // whether a bucket is in the hull

  std::vector<double> turned_;       // the leaves looked at from this viewpoint, one after the
                                     // other
  std::vector<Children> children_;   // of the inner nodes looked at from this viewpoint
  std::vector<LookedAt> looked_at_;  // of each node
  std::uint32_t stamp_ = 0;
  std::vector<std::pair<double, Index>> stack_;
  std::vector<PointRef> doubtful_;
};

}  // namespace vantage::hpr
