#include "point_octree.hpp"

#include <tbb/parallel_for.h>
#include <tbb/parallel_sort.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>

namespace vantage::hpr {
namespace {

constexpr int kBits = 21;  // of a cell's number along an axis

// The lower 21 bits of x, with two zero bits between each.
std::uint64_t spread(std::uint64_t x) {
  x &= 0x1f'ffffU;
  x = (x | x << 32U) & 0x1f'0000'0000'ffffU;
  x = (x | x << 16U) & 0x1f'0000'ff00'00ffU;
  x = (x | x << 8U) & 0x100f'00f0'0f00'f00fU;
  x = (x | x << 4U) & 0x10c3'0c30'c30c'30c3U;
  return (x | x << 2U) & 0x1249'2492'4924'9249U;
}

float rounded_down(double x) {
  const auto f = static_cast<float>(x);
  return static_cast<double>(f) <= x ? f : std::nextafter(f, -std::numeric_limits<float>::max());
}
float rounded_up(double x) { return -rounded_down(-x); }

}  // namespace

PointOctree::PointOctree(PointsView map) {
  const Bounds3 bounds = bounds_of(map);
  origin_ = bounds.min + 0.5 * (bounds.max - bounds.min);
  const double extent = (bounds.max - bounds.min).maxCoeff();
  const double cells_per_metre = extent > 0.0 ? ((1 << kBits) - 1) / extent : 0.0;
  {
    std::vector<Entry> entries(map.size());
    tbb::parallel_for(std::size_t{0}, map.size(), [&](std::size_t i) {
      const Eigen::Vector3d cell = cells_per_metre * (map[i] - bounds.min);
      std::uint64_t key = 0;
      for (int axis = 0; axis < 3; ++axis) {
        key |= spread(static_cast<std::uint64_t>(std::max(0.0, cell[axis]))) << axis;
      }
      entries[i] = {.key = key, .index = static_cast<Index>(i)};
    });
    tbb::parallel_sort(entries.begin(), entries.end(), [](const Entry& a, const Entry& b) {
      return a.key != b.key ? a.key < b.key : a.index < b.index;
    });
    map_index_.resize(map.size());
    tbb::parallel_for(std::size_t{0}, map.size(),
                      [&](std::size_t k) { map_index_[k] = entries[k].index; });
    nodes_.reserve(map.size() / 10 + 16);
    nodes_.push_back(node_over(0, static_cast<Index>(map.size()), kNone));
    split(0, entries, 3 * (kBits - 1));
  }
  points_.resize(map.size());
  tbb::parallel_for(std::size_t{0}, map.size(),
                    [&](std::size_t k) { points_[k] = map[map_index_[k]]; });

  // Children come after their parents. In backward order, every child's box exists before its
  // parent needs it.
  for (std::size_t k = nodes_.size(); k-- > 0;) {
    Node& node = nodes_[k];
    if (node.is_leaf()) {
      Bounds3 box = bounds_of({points_.data() + node.first, node.size()});
      for (int axis = 0; axis < 3; ++axis) {
        node.min[axis] = rounded_down(box.min[axis] - origin_[axis]);
        node.max[axis] = rounded_up(box.max[axis] - origin_[axis]);
      }
      continue;
    }
    node.min = nodes_[node.children_first].min;
    node.max = nodes_[node.children_first].max;
    for (Index c = node.children_first + 1; c < node.children_last; ++c) {
      node.min = node.min.cwiseMin(nodes_[c].min);
      node.max = node.max.cwiseMax(nodes_[c].max);
    }
  }
}

PointOctree::Node PointOctree::node_over(Index first, Index last, Index parent) {
  Node node;
  node.first = first;
  node.last = last;
  node.parent = parent;
  return node;
}

void PointOctree::split(Index parent, std::span<const Entry> entries, int shift) {
  const Index first = nodes_[parent].first, last = nodes_[parent].last;
  if (last - first <= kLeafSize) return;
  const auto octant = [&](Index k) { return (entries[k].key >> shift) & 7U; };
  // Skips octants that hold everything.
  while (shift >= 0 && octant(first) == octant(last - 1)) shift -= 3;
  if (shift < 0) return;  // all in one cell: a leaf, however many points there are
  const auto children_first = static_cast<Index>(nodes_.size());
  for (Index begin = first; begin < last;) {
    const auto beyond = std::partition_point(
        entries.begin() + begin, entries.begin() + last,
        [&](const Entry& e) { return ((e.key >> shift) & 7U) <= octant(begin); });
    const auto end = static_cast<Index>(beyond - entries.begin());
    nodes_.push_back(node_over(begin, end, parent));
    begin = end;
  }
  const auto children_last = static_cast<Index>(nodes_.size());
  nodes_[parent].children_first = children_first;
  nodes_[parent].children_last = children_last;
  for (Index c = children_first; c < children_last; ++c) split(c, entries, shift - 3);
}

}  // namespace vantage::hpr
