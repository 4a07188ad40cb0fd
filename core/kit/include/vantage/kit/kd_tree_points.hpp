#pragma once

#include <Eigen/Core>
#include <cstddef>
#include <span>

namespace vantage {

// NOLINTBEGIN(readability-identifier-naming): the names are nanoflann's.
/// Borrowed points with the interface of a nanoflann data set. This header does not include
/// nanoflann.
/// @tparam Vector  type of a point: Eigen::Vector2d, Eigen::Vector3d
template <class Vector>
struct KdTreePoints {
  std::span<const Vector> points;

  [[nodiscard]] std::size_t kdtree_get_point_count() const { return points.size(); }
  [[nodiscard]] double kdtree_get_pt(std::size_t k, std::size_t axis) const {
    return points[k][static_cast<Eigen::Index>(axis)];
  }
  template <class Box>
  [[nodiscard]] bool kdtree_get_bbox(Box& /*unused*/) const {
    return false;
  }
};
// NOLINTEND(readability-identifier-naming)

}  // namespace vantage
