#include "view/colors.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>
#include <numeric>

namespace vantage::view {
namespace {

constexpr std::size_t kStops = 11;
constexpr std::array<std::uint32_t, kStops> kViridis{0x440154, 0x482475, 0x414487, 0x355f8d,
                                                     0x2a788e, 0x21918c, 0x22a884, 0x44bf70,
                                                     0x7ad151, 0xbddf26, 0xfde725};
constexpr std::array<std::uint32_t, kStops> kMagma{0x000004, 0x140e36, 0x3b0f70, 0x641a80,
                                                   0x8c2981, 0xb73779, 0xde4968, 0xf7705c,
                                                   0xfe9f6d, 0xfecf92, 0xfcfdbf};

// As style.css of reports has them on dark paper: --e0 to --e4.
constexpr std::array<std::uint32_t, 5> kErrors{0x5aa9ee, 0x53cdb5, 0xf2c53d, 0xff8b45, 0xff5d6c};

Color from_hex(std::uint32_t rgb) {
  return Color((rgb >> 16) & 0xff, (rgb >> 8) & 0xff, rgb & 0xff) / 255.0;
}

template <std::size_t N>
Color interpolated(const std::array<std::uint32_t, N>& stops, double t) {
  const double at = std::clamp(t, 0.0, 1.0) * (N - 1);
  const auto below = std::min(static_cast<std::size_t>(at), N - 2);
  const double share = at - static_cast<double>(below);
  return (1.0 - share) * from_hex(stops[below]) + share * from_hex(stops[below + 1]);
}

double gamma(double linear) {
  const double x = std::clamp(linear, 0.0, 1.0);
  return x <= 0.0031308 ? 12.92 * x : 1.055 * std::pow(x, 1.0 / 2.4) - 0.055;
}

/// The distance between two hues [turns]: 0 .. 0.5.
double apart(double a, double b) {
  const double d = std::abs(a - b);
  return std::min(d, 1.0 - d);
}

bool touch(const Bounds2& a, const Bounds2& b) {
  constexpr double kGap = 0.01;  // [m]
  return (a.min.array() <= b.max.array() + kGap).all() &&
         (b.min.array() <= a.max.array() + kGap).all();
}

/// Ids of the regions whose boxes touch, for each region; by a sweep along x.
std::vector<std::vector<std::size_t>> neighbors(const std::vector<Bounds2>& boxes) {
  std::vector<std::size_t> order(boxes.size());
  std::iota(order.begin(), order.end(), std::size_t{0});
  std::sort(order.begin(), order.end(), [&](std::size_t a, std::size_t b) {
    return std::pair(boxes[a].min.x(), a) < std::pair(boxes[b].min.x(), b);
  });
  std::vector<std::vector<std::size_t>> found(boxes.size());
  std::vector<std::size_t> open;
  for (const std::size_t i : order) {
    std::erase_if(open, [&](std::size_t j) { return boxes[j].max.x() + 0.01 < boxes[i].min.x(); });
    for (const std::size_t j : open) {
      if (!touch(boxes[i], boxes[j])) continue;
      found[i].push_back(j);
      found[j].push_back(i);
    }
    open.push_back(i);
  }
  return found;
}

}  // namespace

Color viridis(double t) noexcept { return interpolated(kViridis, t); }
Color magma(double t) noexcept { return interpolated(kMagma, t); }
Color badness(double t) noexcept { return interpolated(kErrors, t); }

Color hue_color(double hue, double lightness) noexcept {
  constexpr double kChroma = 0.125;  // within sRGB for the lightnesses in use
  const double angle = 2.0 * std::numbers::pi * hue;
  const double a = kChroma * std::cos(angle), b = kChroma * std::sin(angle);
  const double l = std::pow(lightness + 0.3963377774 * a + 0.2158037573 * b, 3);
  const double m = std::pow(lightness - 0.1055613458 * a - 0.0638541728 * b, 3);
  const double s = std::pow(lightness - 0.0894841775 * a - 1.2914855480 * b, 3);
  return {gamma(4.0767416621 * l - 3.3077115913 * m + 0.2309699292 * s),
          gamma(-1.2684380046 * l + 2.6097574011 * m - 0.3413193965 * s),
          gamma(-0.0041960863 * l - 0.7034186147 * m + 1.7076147010 * s)};
}

std::vector<double> region_hues(const std::vector<Region>& regions) {
  constexpr std::size_t kHues = 12;
  std::vector<Bounds2> boxes;
  for (const Region& region : regions) boxes.push_back(bounds_of(region.footprint));
  const auto near = neighbors(boxes);
  std::vector<double> hues(regions.size(), -1.0);
  std::array<std::size_t, kHues> used{};
  for (std::size_t r = 0; r < regions.size(); ++r) {
    std::size_t best = 0;
    double best_distance = -1.0;
    for (std::size_t h = 0; h < kHues; ++h) {
      const double hue = static_cast<double>(h) / kHues;
      double distance = 0.5;
      for (const std::size_t n : near[r]) {
        if (hues[n] >= 0.0) distance = std::min(distance, apart(hue, hues[n]));
      }
      const bool better = distance > best_distance + 1e-9;
      const bool equal = !better && distance > best_distance - 1e-9;
      if (better || (equal && used[h] < used[best])) {
        best = h;
        best_distance = std::max(distance, best_distance);
      }
    }
    hues[r] = static_cast<double>(best) / kHues;
    ++used[best];
  }
  return hues;
}

double Range::share(double value) const noexcept {
  return high > low ? std::clamp((value - low) / (high - low), 0.0, 1.0) : 0.0;
}

Range range_of(std::vector<double> values) {
  if (values.empty()) return {};
  const auto quantile = [&](double share) {
    const auto at = values.begin() +
                    static_cast<std::ptrdiff_t>(share * static_cast<double>(values.size() - 1));
    std::nth_element(values.begin(), at, values.end());
    return *at;
  };
  Range range{quantile(0.005), quantile(0.995)};
  if (!(range.high > range.low)) {
    range = {*std::min_element(values.begin(), values.end()),
             *std::max_element(values.begin(), values.end())};
  }
  if (!(range.high > range.low)) range.high = range.low + 1.0;
  return range;
}

}  // namespace vantage::view
