#pragma once

#include <cstdint>
#include <optional>
#include <vector>

#include "sensor.hpp"
#include "vantage/point_cloud.hpp"

namespace vantage::range_image {

/// The place of a point in the image, in fractional pixels.
struct Spot {
  float row = 0.0F;     ///< in [0, rings]
  float column = 0.0F;  ///< in [columns, 2 columns], so that everything left of it is positive, too
  float range = 0.0F;   ///< distance from the viewpoint [m]
  float level = 0.0F;   ///< horizontal part of the range [m]
};

/// The distance of the nearest point for each pixel of a sensor.
class DepthImage {
 public:
  DepthImage(const Sensor& sensor, const Occlusion& occlusion);

  /// Forgets all points.
  void clear();

  /// @param offset  of a point from the viewpoint [m]
  /// @return        nothing if the point is out of range or outside the field of view
  [[nodiscard]] std::optional<Spot> locate(const Point& offset) const;

  /// Draws a point into all pixels that a square of the map's spacing covers at its distance.
  void draw(const Spot& spot);

  /// Computes, after all points are drawn, from which distance on each pixel is hidden.
  void finish();

  /// The pixel of a spot, for `sees`.
  [[nodiscard]] std::uint32_t pixel(const Spot& spot) const;

  /// Whether none of the drawn points hides a point at this distance. Precondition: `finish` was
  /// called.
  [[nodiscard]] bool sees(std::uint32_t pixel, float range) const {
    return range <= surface_[pixel] * stretch_ + tolerance_;
  }

 private:
  /// The column in the image for a column that includes whole turns, at most three; cheaper than a
  /// division.
  [[nodiscard]] std::uint32_t column(std::uint32_t turned) const {
    while (turned >= columns_) turned -= columns_;
    return turned;
  }
  [[nodiscard]] float rows_covered(float range) const;
  [[nodiscard]] float columns_covered(float level) const;

  std::uint32_t rings_, columns_;
  double min_range_, max_range_;
  double sin_lowest_, sin_highest_;
  float lowest_, rows_per_radian_, columns_per_radian_;
  float half_spacing_, tolerance_, stretch_;
  std::vector<float> cosines_;  // of the elevation at the middle of each row
  std::vector<float> nearest_;  // row by row [m]; infinity where there is nothing
  std::vector<float> upright_;  // the farthest of these above and below, as far as points cover [m]
  std::vector<float> surface_;  // the farthest of those to both sides [m]
};

}  // namespace vantage::range_image
