#include "optics.hpp"

#include <algorithm>
#include <cmath>

namespace vantage::surface {
namespace {

// How much a surface still shows if it is seen edge-on, because it is rough.
constexpr float kRoughness = 0.4F;
// The area whose visible size counts, so that it does not depend on the size of elements [m^2].
constexpr float kArea = 0.09F;
constexpr float kEven = 0.29F;  // deviation of points that fill a cell evenly, divided by the
                                // cell's width
// The share of the size that counts for objects that may have moved away, and for anything that is
// not a level or upright piece of a surface.
constexpr float kLowShown = 0.2F, kIrregularShown = 0.5F;
constexpr float kLevel = 0.85F, kUpright = 0.3F;  // |z| of a normal, at least and at most

// Optical depth of an element: proportional to its density, and to the third power of the density
// if the element is thin, because a surface without gaps lets nothing through.
constexpr float kSparseDepth = 0.5F, kFullDepth = 16.0F, kDensest = 1.0F;
// The share of the depth for objects that may have moved away, and for ground, behind which there
// is more ground.
constexpr float kLowDepth = 0.1F, kGroundDepth = 0.3F;
// What an optical depth takes from a size: one share at once, because there is seldom a gap in the
// right place, and little more for each further element, because none of them is certain [dB].
constexpr float kAtOnce = 15.0F, kFollowing = 2.5F, kHowSoon = 0.9F;

}  // namespace

Optics Optics::of(const Shape& shape, double width, double thickness) noexcept {
  const auto cell = static_cast<float>(width);
  // Isolated points hide what is behind them, but do not count as a surface.
  const float deviation = shape.is_isolated ? kEven * cell : shape.thickness;
  const float relative = deviation / static_cast<float>(thickness);
  const float rise = std::abs(shape.axes(2, 0));
  const bool is_regular = shape.is_flat && (rise > kLevel || rise < kUpright);
  const float solid = shape.is_isolated ? 1.0F : 1.0F / (1.0F + relative * relative);
  const float dense = std::min(shape.density, kDensest);
  return {
      // The more cluttered a shape, the less the direction of view matters.
      .roughness =
          shape.is_flat ? std::clamp(shape.thickness / (kEven * cell), kRoughness, 1.0F) : 1.0F,
      .brightness =
          kArea * shape.fill * std::exp(-relative) * (is_regular ? 1.0F : kIrregularShown),
      .depth = kSparseDepth * dense + kFullDepth * dense * dense * dense * solid * solid * solid};
}

Optics Optics::as(Part part) const noexcept {
  Optics optics = *this;
  if (part == Part::low) {
    optics.brightness *= kLowShown;
    optics.depth *= kLowDepth;
  }
  if (part == Part::ground) optics.depth *= kGroundDepth;
  return optics;
}

double brightest() noexcept { return kArea * Elements::fullest(); }

float lost_behind(float depth) noexcept {
  return kAtOnce * (1.0F - std::exp(-kHowSoon * depth)) + kFollowing * depth;
}

float depth_that_takes(float surplus) noexcept {
  float low = 0.0F, high = std::max(surplus, 0.0F) / kFollowing;
  for (int i = 0; i < 12; ++i) {
    const float middle = 0.5F * (low + high);
    (lost_behind(middle) < surplus ? low : high) = middle;
  }
  return high;
}

}  // namespace vantage::surface
