#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <span>
#include <vector>

#include "vantage/partition.hpp"

namespace vantage::view {

using Color = Eigen::Vector3d;  ///< sRGB, 0 .. 1

/// Equal steps look equally different, also without colour vision; `t` is clamped to 0 .. 1.
/// Source: the maps of matplotlib (N. Smith, S. van der Walt; CC0), at eleven places.
[[nodiscard]] Color viridis(double t) noexcept;
[[nodiscard]] Color magma(double t) noexcept;

/// From blue (good) over yellow to red (bad); `t` is clamped to 0 .. 1. The colours of errors in
/// reports.
[[nodiscard]] Color badness(double t) noexcept;

/// A colour of the given hue [turns]; all hues are equally bright. Source: OKLCH (B. Ottosson,
/// 2020).
/// @param lightness  0 .. 1
[[nodiscard]] Color hue_color(double hue, double lightness) noexcept;

/// A hue [turns] for every region, different from those of its neighbours. Regions choose among
/// twelve hues, in the order of their ids. Each takes the hue farthest from those of the regions
/// whose bounding boxes touch its own; of equally far hues, the least used one.
[[nodiscard]] std::vector<double> region_hues(const std::vector<Region>& regions);

/// Low and high end of a colour map: the quantiles 0.5 % and 99.5 % of a sample, so that a stray
/// value does not wash out the rest. Both are 0 without values; otherwise they are never equal.
struct Range {
  double low = 0.0, high = 0.0;
  /// 0 .. 1
  [[nodiscard]] double share(double value) const noexcept;
};
[[nodiscard]] Range range_of(std::vector<double> values);

}  // namespace vantage::view
