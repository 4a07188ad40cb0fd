#pragma once

#include <cstdint>

namespace vantage::range_image {

/// A spinning LiDAR that stands upright.
struct Sensor {
  std::uint32_t rings = 0;    ///< rows of the image, all of equal height
  std::uint32_t columns = 0;  ///< columns of the image, all of equal width, all around
  double lowest = 0.0;        ///< elevation where the field of view begins, included [rad]
  double highest = 0.0;       ///< elevation where it ends, included [rad]
  double min_range = 0.0;     ///< [m]
  double max_range = 0.0;     ///< [m]
};

/// The settings that decide whether a point is hidden.
struct Occlusion {
  double point_spacing = 0.0;       ///< of the map on its surfaces [m]
  double tolerance = 0.0;           ///< how far behind the nearest point another point is still
                                    ///< seen [m]
  double relative_tolerance = 0.0;  ///< added to it, times the nearest distance
};

}  // namespace vantage::range_image
