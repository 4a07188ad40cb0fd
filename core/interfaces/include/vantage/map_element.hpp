#pragma once

#include <array>
#include <cstddef>
#include <cstdint>

#include "vantage/point_cloud.hpp"

namespace vantage {

/// A thing of a prepared map that a scan point is compared with: a distribution or a point.
struct MapElement {
  std::uint32_t number = 0;
  Point middle;              ///< map frame [m]
  std::uint32_t points = 0;  ///< map points that it stands for
};

/// What one element does to the pose of one scan: the derivatives of its term of the objective at
/// the pose of the scan. Rows as in Alignment::Hessian: translation [m], then rotation vector
/// [rad]. Single precision, because there are many.
struct Pull {
  static constexpr std::size_t kUpper = 21;
  std::uint32_t element = 0;
  std::array<float, 6> gradient{};
  std::array<float, kUpper> hessian{};  ///< upper triangle, row by row
};

}  // namespace vantage
