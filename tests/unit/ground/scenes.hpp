#pragma once

#include <cstddef>
#include <functional>
#include <string>

#include "vantage/point_cloud.hpp"

namespace vantage::test {

/// What a filter finds, which must be an answer with indices as the contract wants them.
[[nodiscard]] IndexList ground_by(const std::string& plugin, const PointCloud& cloud,
                                  const std::string& params = {});

using Surface = std::function<double(double x, double y)>;
[[nodiscard]] double level(double x, double y);

/// n random places of a rectangle, at the height of a surface.
[[nodiscard]] PointCloud sampled(std::size_t n, const Eigen::Vector2d& min,
                                 const Eigen::Vector2d& max, const Surface& z, unsigned seed = 1);

void append(PointCloud& cloud, const PointCloud& more);

/// The share of points [begin, end) that is ground.
[[nodiscard]] double share(const IndexList& ground, std::size_t begin, std::size_t end);

/// Ground with a hole of its shape where a box stands; then the box's top, then its walls.
struct Scene {
  PointCloud cloud;
  std::size_t ground = 0, top = 0;  // ends
};
[[nodiscard]] Scene box_on_ground(double half_width, double height, double density = 8.0);

/// Terrain, boxes, trees and outliers over a wide strip, on a lattice that sums of coordinates hold
/// exactly.
[[nodiscard]] PointCloud landscape(double length);

}  // namespace vantage::test
