#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <limits>
#include <span>
#include <string_view>
#include <vector>

#include "vantage/api.hpp"
#include "vantage/result.hpp"

namespace vantage {

using Point = Eigen::Vector3d;                 ///< [m]; 24 bytes, aligned to 8 with any -march
using PointCloud = std::vector<Point>;         ///< owned
using PointsView = std::span<const Point>;     ///< borrowed for one call
using IndexList = std::vector<std::uint32_t>;  ///< strictly ascending indices into a PointsView

/// An axis-aligned box [m], both ends included. A default-constructed one is empty (min > max).
struct Bounds3 {
  Point min = Point::Constant(std::numeric_limits<double>::infinity());
  Point max = Point::Constant(-std::numeric_limits<double>::infinity());

  [[nodiscard]] bool empty() const noexcept { return !(min.array() <= max.array()).all(); }
  /// D of Eq. 6 [m]; 0 for an empty box.
  [[nodiscard]] double diagonal() const noexcept { return empty() ? 0.0 : (max - min).norm(); }
  void extend(const Point& p) noexcept {
    min = min.cwiseMin(p);
    max = max.cwiseMax(p);
  }
};

/// The tightest box around all points; empty if there are none. Points must be finite.
[[nodiscard]] VANTAGE_API Bounds3 bounds_of(PointsView points) noexcept;

/// Whether every coordinate of every point is finite.
[[nodiscard]] VANTAGE_API bool all_finite(PointsView points) noexcept;

/// Errors: `invalid_input` for no points, for 2^32 - 1 points or more, and for a non-finite point
/// (the message says which one).
/// @param what  the name of the points in the message: "the map"
[[nodiscard]] VANTAGE_API Result<void> check_points(PointsView points, std::string_view what);

/// The points that `indices` name, in the order of `indices`. Precondition: every index <
/// points.size().
[[nodiscard]] VANTAGE_API PointCloud select(PointsView points,
                                            std::span<const std::uint32_t> indices);

}  // namespace vantage
