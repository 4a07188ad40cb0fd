#pragma once

#include <Eigen/Core>
#include <array>
#include <bit>
#include <cstddef>
#include <cstdint>
#include <numbers>

#include "vantage/kit/lanes.hpp"

// How much of a sensor's view things fill, for four things at a time: a part of a virtual scan that
// is done far more often than all others. Angles may be too wide, but never too narrow.
namespace vantage::view {

using lanes::bits_of;
using lanes::Floats;
using lanes::floats;
using lanes::Ints;
using lanes::inverse_root;

/// For what Eigen has one instruction, and a comparison would take several.
template <class Use>
[[gnu::always_inline]] inline Floats with_eigen(Floats a, Floats b, const Use& use) {
  alignas(16) auto x = std::bit_cast<std::array<float, 4>>(a);
  alignas(16) const auto y = std::bit_cast<std::array<float, 4>>(b);
  Eigen::Map<Eigen::Array4f, Eigen::Aligned16> to(x.data());
  to = use(to, Eigen::Map<const Eigen::Array4f, Eigen::Aligned16>(y.data()));
  return std::bit_cast<Floats>(x);
}
inline Floats smaller(Floats a, Floats b) {
  return with_eigen(a, b, [](const auto& x, const auto& y) { return x.min(y); });
}
inline Floats larger(Floats a, Floats b) {
  return with_eigen(a, b, [](const auto& x, const auto& y) { return x.max(y); });
}

inline Floats size_of(Floats x) { return std::bit_cast<Floats>(bits_of(x) & INT32_MAX); }
/// Precondition: x >= 0.
inline Floats with_sign_of(Floats y, Floats x) {
  return std::bit_cast<Floats>(bits_of(x) | (bits_of(y) & INT32_MIN));
}
/// `from` - x where the mask is set, x elsewhere.
inline Floats turned(Ints mask, float from, Floats x) {
  return std::bit_cast<Floats>(bits_of(x) ^ (mask & INT32_MIN)) +
         std::bit_cast<Floats>(mask & bits_of(floats(from)));
}

inline Floats root(Floats x) { return lanes::root<2>(x); }

constexpr float kHalfTurn = 3.1416F;  ///< no less than that [rad]
/// Bounds the errors of angles, from the polynomial (2.1e-4) and from rounding [rad].
constexpr float kAngleError = 4e-4F;
/// atan2(y, x) for x >= 0, by a polynomial for the angle to the nearer axis.
inline Floats elevation_of(Floats y, Floats x) {
  const Floats across = size_of(y);
  const Floats a = smaller(x, across) / larger(larger(x, across), floats(1e-30F)), s = a * a;
  const Floats angle = ((-0.0464964749F * s + 0.15931422F) * s - 0.327622764F) * s * a + a;
  return with_sign_of(y, turned(across > x, 0.5F * std::numbers::pi_v<float>, angle));
}
/// atan2(y, x).
inline Floats azimuth_of(Floats y, Floats x) {
  const Floats ahead = elevation_of(size_of(y), size_of(x));
  return with_sign_of(y, turned(x < 0.0F, std::numbers::pi_v<float>, ahead));
}

/// What things fill of the view, but for kAngleError [rad].
struct Extents {
  Floats low, high;          ///< elevations
  Floats azimuth, sideways;  ///< of the middle; from there to each side
};

/// Boxes, with an axis of the map along each edge.
struct Boxes {
  Floats x, y, z;                 ///< from the sensor to the middles [m]
  Floats half_x, half_y, half_z;  ///< edges [m]
};
inline Extents extents_of(const Boxes& boxes) {
  const Floats x = size_of(boxes.x), y = size_of(boxes.y);
  const Floats gap_x = larger(x - boxes.half_x, floats(0.0F));
  const Floats gap_y = larger(y - boxes.half_y, floats(0.0F));
  const Floats far_x = x + boxes.half_x, far_y = y + boxes.half_y;
  const Floats nearest = root(gap_x * gap_x + gap_y * gap_y);
  const Floats farthest = root(far_x * far_x + far_y * far_y);
  const Floats top = boxes.z + boxes.half_z, bottom = boxes.z - boxes.half_z;
  const Floats per_plan = inverse_root<2>(x * x + y * y), plan = (x * x + y * y) * per_plan;
  const Floats ahead = plan - (boxes.half_x * x + boxes.half_y * y) * per_plan;
  const Floats beside = (boxes.half_x * y + boxes.half_y * x) * per_plan;
  return {.low = elevation_of(bottom, bottom > 0.0F ? farthest : nearest),
          .high = elevation_of(top, top > 0.0F ? nearest : farthest),
          .azimuth = azimuth_of(boxes.y, boxes.x),
          .sideways = ahead > 1e-3F ? elevation_of(beside, ahead) : floats(kHalfTurn)};
}

/// Discs, or balls.
struct Discs {
  Floats x, y, z;                       ///< from the sensor to the middles [m]
  Floats normal_x, normal_y, normal_z;  ///< of length 1; 0 for a ball
  Floats radius;                        ///< [m]
};
inline Extents extents_of(const Discs& d) {
  const Floats plan_squared = d.x * d.x + d.y * d.y, squared = plan_squared + d.z * d.z;
  const Floats per_plan = inverse_root<2>(plan_squared), per_away = inverse_root<2>(squared);
  const Floats plan = plan_squared * per_plan, away = squared * per_away;
  // Parts of the normal along directions across the line of sight: to the left and upwards.
  const Floats left = (d.normal_y * d.x - d.normal_x * d.y) * per_plan;
  const Floats ahead = (d.normal_x * d.x + d.normal_y * d.y) * per_plan;
  const Floats up = (d.normal_z * plan - d.z * ahead) * per_away;
  // How far the disc reaches along such a direction.
  const auto reach = [&](Floats part) {
    const Floats squared_sine = larger(1.0F - part * part, floats(1e-6F));
    return 1.002F * d.radius * squared_sine * inverse_root<1>(squared_sine);
  };
  const Floats plan_gap = plan - d.radius;
  const Floats gap = larger(away - d.radius, floats(1e-3F));
  // What lies beside the vertical plane through the middle looks nearer to the horizon: by less
  // than tan(elevation) / 2 times the square of its angle to that plane.
  const Floats seen = d.radius * per_away;
  const Floats slope = (size_of(d.z) + d.radius) / larger(plan_gap, floats(1e-3F));
  const Floats as_ball = 1.571F * seen;
  const Floats vertical = smaller(reach(up) / gap + 0.56F * seen * seen * slope, as_ball);
  const Floats elevation = elevation_of(d.z, plan);
  return {.low = elevation - vertical,
          .high = elevation + vertical,
          .azimuth = azimuth_of(d.y, d.x),
          .sideways = plan_gap > 1e-2F ? reach(left) / plan_gap : floats(kHalfTurn)};
}

/// From the first to the last ring and column of the rays that may meet things.
struct Windows {
  Ints ring, last_ring;
  Ints column, last_column;  ///< they count on beyond a turn

  /// Which of them are not empty: -1, the others 0.
  [[nodiscard]] Ints filled() const { return (ring <= last_ring) & (column <= last_column); }
};

}  // namespace vantage::view
