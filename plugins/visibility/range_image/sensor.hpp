#pragma once

#include <cstdint>

namespace vantage::range_image {

/// A spinning LiDAR that stands upright.
struct Sensor {
  std::uint32_t rings = 0;    ///< rows of the image, equally high
  std::uint32_t columns = 0;  ///< of the image, equally wide, all around
  double lowest = 0.0;        ///< elevation where the field of view begins [rad]
  double highest = 0.0;       ///< and where it ends, both included [rad]
  double min_range = 0.0;     ///< [m]
  double max_range = 0.0;     ///< [m]
};

/// What decides whether a point is hidden.
struct Occlusion {
  double point_spacing = 0.0;       ///< of the map on its surfaces [m]
  double tolerance = 0.0;           ///< how far behind the nearest a point is still seen [m]
  double relative_tolerance = 0.0;  ///< and how much farther, times the nearest distance
};

}  // namespace vantage::range_image
