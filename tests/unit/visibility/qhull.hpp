#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "vantage/point_cloud.hpp"
#include "vantage/result.hpp"

namespace vantage::test {

/// A vertex of a hull as double precision has it.
struct RoughVertex {
  std::uint32_t index;
  Point outward;  ///< sum of the normals of the facets around it
};

/// The vertices of the convex hull of the points and the origin, by Qhull (Barber, Dobkin,
/// Huhdanpaa 1996) with its own tolerance; the origin is left out.
/// @return  by index, strictly ascending
/// Errors: `invalid_input` where the points are flat within the tolerance, `internal` for the rest.
/// Thread safety: may run in many threads at once. Prints nothing.
[[nodiscard]] Result<std::vector<RoughVertex>> qhull_vertices(std::span<const Point> points);

}  // namespace vantage::test
