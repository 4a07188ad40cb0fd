#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <span>
#include <string>
#include <vector>

#include "vantage/point_cloud.hpp"

namespace vantage::report {

/// Points as 16-bit numbers in a box: origin + step * number, along each axis.
struct QuantizedPoints {
  Point origin = Point::Zero();
  Point step = Point::Zero();  ///< [m]; a point moves by at most half a step
  std::vector<std::array<std::uint16_t, 3>> points;

  [[nodiscard]] Point at(std::size_t i) const;
};
/// @param box  points outside it are moved to its border
[[nodiscard]] QuantizedPoints quantized(PointsView points, const Bounds3& box);

/// Little endian, x y z x y z ...
[[nodiscard]] std::string base64(const QuantizedPoints& points);
[[nodiscard]] std::string base64(std::span<const std::uint8_t> bytes);

/// At most `most` of the points, spread evenly over the area that they cover: one per voxel, with
/// voxels of the size that this takes; sorted. The result depends only on the set of points, not on
/// their order.
[[nodiscard]] PointCloud thinned(PointsView points, std::size_t most);

}  // namespace vantage::report
