#pragma once

#include <cstddef>
#include <span>
#include <vector>

#include "vantage/point_cloud.hpp"

namespace vantage::hpr {

/// Finds, exactly, which points are vertices of the convex hull of all points and the origin, if
/// all of them lie in one plane through the origin or on one line through it. All points at the
/// place of a vertex count; a point on an edge does not.
/// @return  indices, in no particular order
[[nodiscard]] std::vector<std::size_t> flat_hull_vertices(std::span<const Point> points);

}  // namespace vantage::hpr
