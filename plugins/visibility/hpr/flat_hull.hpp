#pragma once

#include <cstddef>
#include <span>
#include <vector>

#include "vantage/point_cloud.hpp"

namespace vantage::hpr {

/// Which points are vertices of the convex hull of all of them and the origin, exactly, where all
/// lie in one plane through the origin or on one line through it. Points at the place of a vertex
/// all count; a point on an edge does not.
/// @return  indices, in no order
[[nodiscard]] std::vector<std::size_t> flat_hull_vertices(std::span<const Point> points);

}  // namespace vantage::hpr
