#pragma once

#include "elements.hpp"

namespace vantage::surface {

/// How a shape shows and hides, whatever the viewpoint.
struct Optics {
  float roughness = 1.0F;   ///< share of its face that it shows and hides when seen edge-on
  float brightness = 0.0F;  ///< visible size of 0.09 m^2 of it at 1 m, seen face on [sr]
  float depth = 0.0F;       ///< optical depth for everything behind it

  /// @param width      of the element's cell [m]
  /// @param thickness  of a surface's points [m]
  [[nodiscard]] static Optics of(const Shape& shape, double width, double thickness) noexcept;

  /// The same for an element that belongs to a part of the scene.
  [[nodiscard]] Optics as(Part part) const noexcept;
};

/// The largest possible brightness of an element [sr].
[[nodiscard]] double brightest() noexcept;

/// What an optical depth in front of a size takes from it [dB].
[[nodiscard]] float lost_behind(float depth) noexcept;

/// The optical depth behind which nothing is seen of a size. Never too small.
/// @param surplus  of the size over the smallest that is seen [dB]
[[nodiscard]] float depth_that_takes(float surplus) noexcept;

}  // namespace vantage::surface
