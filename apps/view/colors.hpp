#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <span>
#include <vector>

#include "vantage/partition.hpp"

namespace vantage::view {

using Color = Eigen::Vector3d;  ///< sRGB, 0 .. 1

/// Equal steps look equally far apart, also without colour vision; `t` is clamped to 0 .. 1.
/// Source: the maps of matplotlib (N. Smith, S. van der Walt; CC0), at eleven places.
[[nodiscard]] Color viridis(double t) noexcept;
[[nodiscard]] Color magma(double t) noexcept;

/// A hue [turns] as bright as any other hue. Source: OKLCH (B. Ottosson, 2020).
/// @param lightness  0 .. 1
[[nodiscard]] Color hue_color(double hue, double lightness) noexcept;

/// A hue [turns] for every region, far from those of its neighbours: regions in the order of their
/// ids take, of twelve hues, the one furthest from those of the regions whose bounding boxes touch
/// theirs, and of equally far ones the least used.
[[nodiscard]] std::vector<double> region_hues(const std::vector<Region>& regions);

/// Low and high end of a colour map: the quantiles 0.5 % and 99.5 % of a sample, so that a stray
/// value does not wash out the rest. Both 0 for no values; never equal otherwise.
struct Range {
  double low = 0.0, high = 0.0;
  /// 0 .. 1
  [[nodiscard]] double share(double value) const noexcept;
};
[[nodiscard]] Range range_of(std::vector<double> values);

}  // namespace vantage::view
