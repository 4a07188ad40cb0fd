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
#include "turned_octree.hpp"
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
  void look_from(const Point& viewpoint);
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

  TurnedOctree turned_octree_;
  std::vector<PointRef> doubtful_;
};

}  // namespace vantage::hpr
