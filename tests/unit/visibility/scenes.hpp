#pragma once

#include <cstdint>
#include <optional>
#include <string>

#include "hidden_point_removal.hpp"
#include "vantage/visibility.hpp"

namespace vantage::test {

/// Points evenly distributed in a ball about a centre, none nearer to it than `hollow` [m].
[[nodiscard]] PointCloud ball(std::uint32_t seed, std::size_t size, double radius,
                              double hollow = 0.0, const Point& centre = Point::Zero());

/// Points on a sphere about the origin, evenly spread (Fibonacci), none at a pole.
[[nodiscard]] PointCloud sphere(std::size_t size, double radius);

/// (2 half + 1)^3 points, `spacing` apart, about the origin.
[[nodiscard]] PointCloud lattice(int half, double spacing);

/// Points of the plane x = distance, `spacing` apart, with |y|, |z| <= half * spacing; shifted by
/// half a spacing in y so that (distance, 0, 0) lies amid two of them.
[[nodiscard]] PointCloud wall(double distance, int half, double spacing);

[[nodiscard]] PointCloud joined(PointCloud a, const PointCloud& b);
[[nodiscard]] PointCloud translated(PointCloud cloud, const Eigen::Vector3d& by);
/// Coordinates rounded to multiples of 2^-20 m, so that whole metres up to 2^32 can be added
/// without rounding.
[[nodiscard]] PointCloud snapped(PointCloud cloud);

/// The map of the recorded street; nothing where the recorded data is absent.
[[nodiscard]] const std::optional<PointCloud>& street();
/// Every n-th of its points so that `size` remain.
[[nodiscard]] PointCloud thinned(const PointCloud& cloud, std::size_t size);

[[nodiscard]] hpr::Settings flip(PointsView map, double alpha);
[[nodiscard]] hpr::Settings inversion();

/// One viewpoint through the plugin named `hpr`; an error ends the test.
[[nodiscard]] IndexList seen(PointsView map, const Point& viewpoint, const std::string& params = {},
                             double max_range = std::numeric_limits<double>::infinity());

}  // namespace vantage::test
