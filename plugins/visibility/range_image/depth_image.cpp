#include "depth_image.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <numbers>

namespace vantage::range_image {
namespace {

constexpr float kPi = std::numbers::pi_v<float>;
constexpr float kNothing = std::numeric_limits<float>::infinity();
// A point covers a part of the pixel where it ends; the surface's next pixel begins after that.
constexpr std::uint32_t kAround = 2;
constexpr double kAtViewpoint = 1e-30, kFarthest = 1e15;  // [m]; float holds what is between

/// The angle of (x, y), in [-pi, pi], to 1e-6: Abramowitz & Stegun 4.4.49. Unlike the library's
/// function, it gives the same result on every machine.
float angle_of(float y, float x) {
  const float ax = std::abs(x), ay = std::abs(y);
  const float larger = std::max(ax, ay);
  if (!(larger > 0.0F)) return 0.0F;
  const float t = std::min(ax, ay) / larger, s = t * t, q = s * s;
  // The sums over even and odd powers of s can be computed at the same time.
  const float even =
      (((0.0028662257F * q + 0.0429096138F) * q + 0.1065626393F) * q + 0.1999355085F) * q + 1.0F;
  const float odd = ((-0.0161657367F * q - 0.0752896400F) * q - 0.1420889944F) * q - 0.3333314528F;
  const float angle = t * (even + s * odd);
  // By octant, from a table, because a processor cannot predict these branches.
  constexpr std::array<float, 4> kFrom{0.0F, 0.5F * kPi, kPi, 0.5F * kPi};
  constexpr std::array<float, 4> kSign{1.0F, -1.0F, -1.0F, 1.0F};
  const std::size_t octant = (ay > ax ? 1U : 0U) + (x < 0.0F ? 2U : 0U);
  return std::copysign(kFrom[octant] + kSign[octant] * angle, y);
}

/// The farther of two ranges; an infinite range does not count.
float farther(float range, float other) {
  return other < kNothing ? std::max(range, other) : range;
}

}  // namespace

DepthImage::DepthImage(const Sensor& sensor, const Occlusion& occlusion)
    : rings_(sensor.rings),
      columns_(sensor.columns),
      min_range_(sensor.min_range),
      max_range_(std::min(sensor.max_range, kFarthest)),
      sin_lowest_(std::sin(sensor.lowest)),
      sin_highest_(std::sin(sensor.highest)),
      lowest_(static_cast<float>(sensor.lowest)),
      rows_per_radian_(static_cast<float>(sensor.rings / (sensor.highest - sensor.lowest))),
      columns_per_radian_(static_cast<float>(0.5 * sensor.columns / std::numbers::pi)),
      half_spacing_(static_cast<float>(0.5 * occlusion.point_spacing)),
      tolerance_(static_cast<float>(occlusion.tolerance)),
      stretch_(static_cast<float>(1.0 + occlusion.relative_tolerance)),
      nearest_(std::size_t{sensor.rings} * sensor.columns, kNothing),
      upright_(nearest_.size()),
      surface_(nearest_.size()) {
  const double height = (sensor.highest - sensor.lowest) / sensor.rings;
  for (std::uint32_t row = 0; row < rings_; ++row) {
    cosines_.push_back(static_cast<float>(std::cos(sensor.lowest + (row + 0.5) * height)));
  }
}

void DepthImage::clear() { std::fill(nearest_.begin(), nearest_.end(), kNothing); }

std::optional<Spot> DepthImage::locate(const Point& offset) const {
  const double range = offset.norm();
  if (!(range > kAtViewpoint && range >= min_range_ && range <= max_range_)) return std::nullopt;
  // Compares sines, because straight up and straight down they are exactly 1 and -1.
  if (offset.z() < sin_lowest_ * range || offset.z() > sin_highest_ * range) return std::nullopt;
  const Eigen::Vector3f direction = (offset * (1.0 / range)).cast<float>();
  const float level = direction.head<2>().norm();
  const float row = (angle_of(direction.z(), level) - lowest_) * rows_per_radian_;
  const float turn = (angle_of(direction.y(), direction.x()) + kPi) * columns_per_radian_;
  const auto columns = static_cast<float>(columns_);
  const auto distance = static_cast<float>(range);
  return Spot{.row = std::clamp(row, 0.0F, static_cast<float>(rings_)),
              .column = columns + std::clamp(turn, 0.0F, columns),
              .range = distance,
              .level = level * distance};
}

std::uint32_t DepthImage::pixel(const Spot& spot) const {
  const std::uint32_t row = std::min(static_cast<std::uint32_t>(spot.row), rings_ - 1);
  return row * columns_ + column(static_cast<std::uint32_t>(spot.column));
}

// What a square of the map's spacing covers above and below, in rows.
float DepthImage::rows_covered(float range) const {
  return std::min(half_spacing_ / range, kPi) * rows_per_radian_;
}

// What the square covers to each side, in columns; all columns together if it covers the pole.
float DepthImage::columns_covered(float level) const {
  if (!(half_spacing_ < level)) return static_cast<float>(columns_);
  const float sine = half_spacing_ / level;
  // Never less than the arc sine, and equal to it at 0 and 1.
  return (sine + (0.5F * kPi - 1.0F) * sine * sine * sine) * columns_per_radian_;
}

void DepthImage::draw(const Spot& spot) {
  const float up = rows_covered(spot.range), aside = columns_covered(spot.level);
  const auto lower = static_cast<std::uint32_t>(std::max(spot.row - up, 0.0F));
  const auto upper = static_cast<std::uint32_t>(spot.row + up);
  const auto first = static_cast<std::uint32_t>(std::max(spot.column - aside, 0.0F));
  const auto last = static_cast<std::uint32_t>(spot.column + aside);
  const std::uint32_t width = std::min(last - first + 1, columns_);
  const std::uint32_t begin = column(first);
  const std::uint32_t end = std::min(begin + width, columns_);
  for (std::uint32_t row = std::min(lower, rings_ - 1); row <= std::min(upper, rings_ - 1); ++row) {
    float* const pixels = nearest_.data() + std::size_t{row} * columns_;
    const auto draw_span = [&](std::uint32_t from, std::uint32_t to) {
      for (std::uint32_t i = from; i < to; ++i) pixels[i] = std::min(pixels[i], spot.range);
    };
    draw_span(begin, end);
    draw_span(0, width - (end - begin));
  }
}

// Minima over what points cover, then maxima over the same extent: a closing of the surface. Gaps
// between points stay filled, and surfaces regain the slope and the borders that large points
// removed.
void DepthImage::finish() {
  for (std::uint32_t row = 0; row < rings_; ++row) {
    for (std::uint32_t at = 0; at < columns_; ++at) {
      const std::size_t here = std::size_t{row} * columns_ + at;
      float farthest = nearest_[here];
      if (farthest < kNothing) {
        const auto reach = kAround + static_cast<std::uint32_t>(rows_covered(nearest_[here]));
        const std::uint32_t last = std::min(row + reach, rings_ - 1);
        for (std::uint32_t other = row - std::min(row, reach); other <= last; ++other) {
          farthest = farther(farthest, nearest_[std::size_t{other} * columns_ + at]);
        }
      }
      upright_[here] = farthest;
    }
  }
  for (std::uint32_t row = 0; row < rings_; ++row) {
    const float* const ranges = upright_.data() + std::size_t{row} * columns_;
    for (std::uint32_t at = 0; at < columns_; ++at) {
      const std::size_t here = std::size_t{row} * columns_ + at;
      float farthest = ranges[at];
      if (farthest < kNothing) {
        const auto covered =
            static_cast<std::uint32_t>(columns_covered(nearest_[here] * cosines_[row]));
        const std::uint32_t reach = std::min(kAround + covered, columns_ / 2);
        std::uint32_t other = column(at + columns_ - reach);
        for (std::uint32_t k = 0; k <= 2 * reach; ++k) {
          farthest = farther(farthest, ranges[other]);
          if (++other == columns_) other = 0;
        }
      }
      surface_[here] = farthest;
    }
  }
}

}  // namespace vantage::range_image
