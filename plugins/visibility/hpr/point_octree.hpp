#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <span>
#include <vector>

#include "vantage/point_cloud.hpp"

namespace vantage::hpr {

/// The points of a map in the order of an octree's leaves, and the boxes around them. The place of
/// a point in that order is called its `position`.
class PointOctree {
 public:
  using Index = std::uint32_t;
  static constexpr Index kNone = 0xffff'ffffU;
  static constexpr Index kLeafSize =
      96;  ///< more only if so many points are in one cell of 2^-21 of the map

  struct Node {
    Eigen::Vector3f min = Eigen::Vector3f::Zero();  ///< of the box around the points, relative to
                                                    ///< `origin`
    Eigen::Vector3f max = Eigen::Vector3f::Zero();  ///< [m]; both rounded outward
    Index first = 0, last = 0;                      ///< positions [first, last)
    Index children_first = 0, children_last = 0;    ///< nodes; none for a leaf
    Index parent = kNone;                           ///< kNone for the root

    [[nodiscard]] bool is_leaf() const { return children_first == children_last; }
    [[nodiscard]] Index size() const { return last - first; }
  };

  /// @param map  1 to 2^32 - 2 finite points [m]; not kept
  explicit PointOctree(PointsView map);

  [[nodiscard]] std::span<const Node> nodes() const { return nodes_; }  ///< [0] is the root
  [[nodiscard]] std::span<const Point> points() const { return points_; }
  [[nodiscard]] const Point& origin() const { return origin_; }
  /// The index in the map of the point at that position.
  [[nodiscard]] Index map_index(Index position) const { return map_index_[position]; }

 private:
  struct Entry {
    std::uint64_t key;  // interleaved bits of the cell
    Index index;        // into the map
  };
  [[nodiscard]] static Node node_over(Index first, Index last, Index parent);
  void split(Index node, std::span<const Entry> entries, int shift);

  Point origin_;
  std::vector<Point> points_;
  std::vector<Index> map_index_;
  std::vector<Node> nodes_;
};

}  // namespace vantage::hpr
