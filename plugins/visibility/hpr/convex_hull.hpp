#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "vantage/result.hpp"

namespace vantage::hpr {

/// The vertices of the convex hull of points in the plane or in space, by Qhull (Barber, Dobkin,
/// Huhdanpaa 1996) with its default handling of rounding: a point within Qhull's own tolerance
/// (about 1e-14 of the largest coordinate) of a facet is no vertex.
/// @param coordinates  dimension numbers a point, finite
/// @param dimension    2 or 3
/// @return             indices of the vertices, strictly ascending
/// Errors: `invalid_input` where the points are flat (all in a line or plane within the tolerance,
/// or no more than `dimension`); `internal` with Qhull's message for anything else.
/// Thread safety: may run in many threads at once. Prints nothing.
[[nodiscard]] Result<std::vector<std::uint32_t>> convex_hull_vertices(
    std::span<const double> coordinates, int dimension);

}  // namespace vantage::hpr
