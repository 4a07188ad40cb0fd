#include "report/plan.hpp"

#include <fmt/format.h>
#include <png.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <map>

#include "report/chart.hpp"
#include "report/html.hpp"
#include "report/points.hpp"

namespace vantage::report {
namespace {

struct Rgb {
  double r, g, b;
};
// viridis without its darkest and brightest ends, so that the colours differ from white and from
// black.
constexpr std::array<Rgb, 7> kHeights{{{72, 35, 116},
                                       {63, 74, 138},
                                       {47, 108, 142},
                                       {33, 144, 141},
                                       {53, 183, 121},
                                       {134, 206, 76},
                                       {225, 205, 40}}};

Rgb height_colour(double share) {
  const double at = std::clamp(share, 0.0, 1.0) * static_cast<double>(kHeights.size() - 1);
  const auto below = std::min(static_cast<std::size_t>(at), kHeights.size() - 2);
  const double rest = at - static_cast<double>(below);
  const Rgb &a = kHeights[below], &b = kHeights[below + 1];
  return {std::lerp(a.r, b.r, rest), std::lerp(a.g, b.g, rest), std::lerp(a.b, b.b, rest)};
}

/// What each pixel contains of a cloud.
struct Raster {
  std::size_t width, height;
  std::vector<std::uint32_t> counts;
  std::vector<float> tops;  ///< [m]
};

Raster raster_at(PointsView points, PlanWindow window, double pixels_per_unit) {
  window.width *= pixels_per_unit;
  Raster raster{static_cast<std::size_t>(std::lround(window.width)),
                static_cast<std::size_t>(std::max(1L, std::lround(window.height()))),
                {},
                {}};
  raster.counts.assign(raster.width * raster.height, 0);
  raster.tops.assign(raster.width * raster.height, 0.0F);
  for (const Point& p : points) {
    const double x = window.x(p.x()), y = window.y(p.y());
    if (!(x >= 0.0 && y >= 0.0 && x < static_cast<double>(raster.width) &&
          y < static_cast<double>(raster.height))) {
      continue;
    }
    const std::size_t i = static_cast<std::size_t>(y) * raster.width + static_cast<std::size_t>(x);
    const auto z = static_cast<float>(p.z());
    raster.tops[i] = raster.counts[i] == 0 ? z : std::max(raster.tops[i], z);
    ++raster.counts[i];
  }
  return raster;
}

/// Finer than the picture is drawn, for screens and prints with a higher resolution; but not if
/// there are so few points that they would only become smaller.
Raster raster_of(PointsView points, const PlanWindow& window) {
  constexpr double kFine = 2.0, kFull = 0.35;
  Raster fine = raster_at(points, window, kFine);
  const auto empty = std::count(fine.counts.begin(), fine.counts.end(), 0U);
  const double full = 1.0 - static_cast<double>(empty) / static_cast<double>(fine.counts.size());
  return full >= kFull ? fine : raster_at(points, window, 1.0);
}

/// How dense a pixel is, from 0 to 1: by the logarithm, between the sparse and the dense pixels of
/// this raster.
class Density {
 public:
  explicit Density(const Raster& raster) {
    std::vector<std::uint32_t> counts;
    for (const std::uint32_t n : raster.counts) {
      if (n > 0) counts.push_back(n);
    }
    if (counts.empty()) return;
    const auto at = [&](double share) {
      const auto place = counts.begin() + static_cast<std::ptrdiff_t>(
                                              share * static_cast<double>(counts.size() - 1));
      std::nth_element(counts.begin(), place, counts.end());
      return std::log(static_cast<double>(*place));
    };
    low_ = at(0.25);
    high_ = std::max(at(0.985), low_ + std::log(2.0));
  }
  [[nodiscard]] double of(std::uint32_t count) const {
    return std::clamp((std::log(static_cast<double>(count)) - low_) / (high_ - low_), 0.0, 1.0);
  }

 private:
  double low_ = 0.0, high_ = 1.0;
};

Result<std::string> encoded(const Raster& raster, const std::vector<png_byte>& pixels,
                            const std::vector<std::array<png_byte, 4>>& colours) {
  png_image image{};
  image.version = PNG_IMAGE_VERSION;
  image.width = static_cast<png_uint_32>(raster.width);
  image.height = static_cast<png_uint_32>(raster.height);
  image.format = PNG_FORMAT_RGBA_COLORMAP;
  image.colormap_entries = static_cast<png_uint_32>(colours.size());
  png_alloc_size_t size = 0;
  const auto write = [&](void* to) {
    return png_image_write_to_memory(&image, to, &size, 0, pixels.data(), 0, colours.data());
  };
  if (write(nullptr) == 0) return fail(ErrorCode::internal, std::string("PNG: ") + image.message);
  std::vector<std::uint8_t> bytes(size);
  if (write(bytes.data()) == 0) {
    return fail(ErrorCode::internal, std::string("PNG: ") + image.message);
  }
  bytes.resize(size);
  return "data:image/png;base64," + base64(bytes);
}

png_byte byte(double x) { return static_cast<png_byte>(std::lround(std::clamp(x, 0.0, 255.0))); }

using Line = std::array<Eigen::Vector2d, 2>;

std::vector<Line> ring(const std::vector<Eigen::Vector2d>& corners) {
  std::vector<Line> lines;
  for (std::size_t i = 0; i < corners.size(); ++i) {
    lines.push_back({corners[i], corners[(i + 1) % corners.size()]});
  }
  return lines;
}

/// How often boxes begin and end along each line of one axis. Where that number is even, there is
/// no border between inside and outside.
class Borders {
 public:
  void add(double at, double from, double to, int sign) {
    auto& changes = lines_[at];
    changes[from] += sign;
    changes[to] -= sign;
  }
  /// Calls the function with (at, from, to).
  template <class F>
  void each(const F& border) const {
    for (const auto& [at, changes] : lines_) {
      int sum = 0;
      double from = 0.0;
      for (const auto& [place, change] : changes) {
        if (sum != 0 && change != 0) border(at, from, place);
        if (change != 0) from = place;
        sum += change;
      }
    }
  }

 private:
  std::map<double, std::map<double, int>> lines_;
};

std::vector<Line> lines_of(const HalfOpenBox& b) {
  return ring({b.min, {b.max.x(), b.min.y()}, b.max, {b.min.x(), b.max.y()}});
}
std::vector<Line> lines_of(const ConvexPolygon& polygon) { return ring(polygon.corners); }
std::vector<Line> lines_of(const BoxUnion& shape) {
  Borders upright, level;
  for (const HalfOpenBox& b : shape.boxes) {
    upright.add(b.min.x(), b.min.y(), b.max.y(), 1);
    upright.add(b.max.x(), b.min.y(), b.max.y(), -1);
    level.add(b.min.y(), b.min.x(), b.max.x(), 1);
    level.add(b.max.y(), b.min.x(), b.max.x(), -1);
  }
  std::vector<Line> lines;
  upright.each([&](double x, double from, double to) { lines.push_back({{{x, from}, {x, to}}}); });
  level.each([&](double y, double from, double to) { lines.push_back({{{from, y}, {to, y}}}); });
  return lines;
}

}  // namespace

PlanWindow window_around(const Eigen::Vector2d& low, const Eigen::Vector2d& high, double border,
                         double least, double most_width, double most_height) {
  constexpr double kSlender = 2.5;
  const Eigen::Vector2d middle = 0.5 * (low + high);
  Eigen::Vector2d half = (0.5 * (high - low).array() + border).max(0.5 * least);
  half.x() = std::max(half.x(), half.y() / kSlender);
  half.y() = std::max(half.y(), half.x() / kSlender);
  PlanWindow window{middle - half, middle + half, most_width};
  if (window.height() > most_height) window.width *= most_height / window.height();
  window.width = std::round(window.width);
  return window;
}

PlanWindow window_of_drive(const Extent& drive) {
  Extent extent = drive;
  if (extent.empty()) extent.see(Eigen::Vector2d::Zero());
  const double border = std::clamp(0.06 * (extent.high - extent.low).maxCoeff(), 10.0, 40.0);
  return window_around(extent.low, extent.high, border, 40.0, 560.0, 520.0);
}

std::string plan_opening(const std::string& title, const std::string& note,
                         const PlanWindow& window) {
  constexpr double kHead = 26.0;
  std::string svg = fmt::format(
      "<svg class=\"plan\" viewBox=\"0 0 {:.0f} {:.0f}\" role=\"img\" aria-label=\"{}\" "
      "xmlns=\"http://www.w3.org/2000/svg\">\n",
      window.width, window.height() + kHead, escaped(title));
  svg += fmt::format(
      "<text class=\"title\" x=\"2\" y=\"16\">{}<tspan class=\"soft\" "
      "dx=\"8\">{}</tspan></text>\n",
      escaped(shortened(title, 40)), escaped(note));
  svg += fmt::format("<svg y=\"{:.0f}\" width=\"{:.0f}\" height=\"{:.1f}\">\n", kHead, window.width,
                     window.height());
  return svg + fmt::format("<rect class=\"frame\" width=\"{:.0f}\" height=\"{:.1f}\"/>\n",
                           window.width, window.height());
}

std::string plan_end() { return "</svg></svg>\n"; }

std::string shared_picture(const std::string& id, const PlanWindow& window,
                           const std::string& png) {
  return fmt::format(
      "<svg width=\"0\" height=\"0\" class=\"shared\" aria-hidden=\"true\"><defs><image id=\"{}\" "
      "width=\"{:.0f}\" height=\"{:.1f}\" href=\"{}\" "
      "style=\"image-rendering:auto\"/></defs></svg>\n",
      id, window.width, window.height(), png);
}

std::string polyline_point(const Eigen::Vector2d& p, const PlanWindow& window) {
  return fmt::format("{:.1f},{:.1f} ", window.x(p.x()), window.y(p.y()));
}

std::string border_path(const std::string& outlines) {
  return outlines.empty() ? "" : fmt::format("<path class=\"border\" d=\"{}\"/>\n", outlines);
}

std::string plan_dot(const Eigen::Vector2d& p, const PlanWindow& window, const std::string& look,
                     double radius, const std::string& tip) {
  return fmt::format(
      "<circle class=\"{}\" cx=\"{:.1f}\" cy=\"{:.1f}\" r=\"{:.1f}\"><title>{}</title></circle>\n",
      look, window.x(p.x()), window.y(p.y()), radius, escaped(tip));
}

std::string plan_ring(const Eigen::Vector2d& p, const PlanWindow& window, double radius,
                      const std::string& tip) {
  return plan_dot(p, window, "switch", radius, tip);
}

std::string plan_rhomb(const Eigen::Vector2d& p, const PlanWindow& window, const std::string& tip) {
  return fmt::format(
      "<path class=\"uncertain\" d=\"M{:.1f} {:.1f}l4 4l-4 4l-4 -4z\"><title>{}</title></path>\n",
      window.x(p.x()), window.y(p.y()) - 4.0, escaped(tip));
}

std::string plan_cross(const Eigen::Vector2d& p, const PlanWindow& window, const std::string& tip) {
  return fmt::format(
      "<path class=\"lost\" d=\"M{:.1f} {:.1f}l8 8m0 -8l-8 8\"><title>{}</title></path>\n",
      window.x(p.x()) - 4.0, window.y(p.y()) - 4.0, escaped(tip));
}

std::string legend_of_drive() {
  return "<span><i class=\"dot ringed\"></i>map switched</span> <span><i "
         "class=\"rhomb\">◇</i>scan uncertain</span> <span><i class=\"cross\">✕</i>scan "
         "lost</span> <span><i class=\"bar\"></i>region border</span>";
}

Result<std::string> density_picture(PointsView points, const PlanWindow& window) {
  constexpr std::size_t kLevels = 16;
  const Raster raster = raster_of(points, window);
  const Density density(raster);
  std::vector<png_byte> pixels(raster.counts.size());
  std::transform(raster.counts.begin(), raster.counts.end(), pixels.begin(), [&](std::uint32_t n) {
    return n == 0 ? png_byte{0} : byte((0.22 + 0.78 * density.of(n)) * (kLevels - 1));
  });
  std::vector<std::array<png_byte, 4>> colours;
  for (std::size_t i = 0; i < kLevels; ++i) {
    colours.push_back({0, 0, 0, byte(255.0 * static_cast<double>(i) / (kLevels - 1))});
  }
  return encoded(raster, pixels, colours);
}

Result<std::string> height_picture(PointsView points, const PlanWindow& window, double low,
                                   double high) {
  constexpr std::size_t kHues = 60, kLevels = 4;
  const Raster raster = raster_of(points, window);
  const Density density(raster);
  std::vector<png_byte> pixels(raster.counts.size(), 0);
  for (std::size_t i = 0; i < pixels.size(); ++i) {
    if (raster.counts[i] == 0) continue;
    const double height =
        std::clamp((static_cast<double>(raster.tops[i]) - low) / (high - low), 0.0, 1.0);
    const auto hue = static_cast<std::size_t>(std::lround(height * (kHues - 1)));
    const auto level =
        std::min(kLevels - 1, static_cast<std::size_t>(density.of(raster.counts[i]) * kLevels));
    pixels[i] = static_cast<png_byte>(1 + hue * kLevels + level);
  }
  std::vector<std::array<png_byte, 4>> colours{{0, 0, 0, 0}};
  for (std::size_t hue = 0; hue < kHues; ++hue) {
    const Rgb c = height_colour(static_cast<double>(hue) / (kHues - 1));
    for (std::size_t level = 0; level < kLevels; ++level) {
      colours.push_back({byte(c.r), byte(c.g), byte(c.b),
                         byte(255.0 * (0.7 + 0.1 * static_cast<double>(level)))});
    }
  }
  return encoded(raster, pixels, colours);
}

Heights heights_of(PointsView points) {
  if (points.empty()) return {};
  std::vector<double> z;
  z.reserve(points.size());
  for (const Point& p : points) z.push_back(p.z());
  const auto at = [&](double share) {
    const auto place =
        z.begin() + static_cast<std::ptrdiff_t>(share * static_cast<double>(z.size() - 1));
    std::nth_element(z.begin(), place, z.end());
    return *place;
  };
  Heights heights{at(0.005), at(0.995)};
  heights.high = std::max(heights.high, heights.low + 0.1);
  return heights;
}

std::string height_gradient_stops() {
  std::string svg;
  for (std::size_t i = 0; i < kHeights.size(); ++i) {
    const Rgb& c = kHeights[i];
    svg += fmt::format("<stop offset=\"{:.3f}\" stop-color=\"rgb({},{},{})\"/>",
                       static_cast<double>(i) / static_cast<double>(kHeights.size() - 1), c.r, c.g,
                       c.b);
  }
  return svg;
}

std::vector<Eigen::Vector2d> outline_lines(const Footprint& footprint) {
  std::vector<Eigen::Vector2d> ends;
  for (const Line& line :
       std::visit([](const auto& shape) { return lines_of(shape); }, footprint)) {
    ends.insert(ends.end(), line.begin(), line.end());
  }
  return ends;
}

std::string outline(const Footprint& footprint, const PlanWindow& window) {
  const std::vector<Eigen::Vector2d> ends = outline_lines(footprint);
  Eigen::Vector2d low = ends.front(), high = ends.front();
  for (const Eigen::Vector2d& p : ends) {
    low = low.cwiseMin(p);
    high = high.cwiseMax(p);
  }
  if ((high.array() < window.min.array()).any() || (low.array() > window.max.array()).any())
    return {};
  // Every program would cut off a border far outside in a different way.
  const Eigen::Vector2d room = window.max - window.min;
  std::string d;
  for (std::size_t i = 0; i + 1 < ends.size(); i += 2) {
    const auto at = [&](const Eigen::Vector2d& p) {
      const Eigen::Vector2d q = p.cwiseMax(window.min - room).cwiseMin(window.max + room);
      return fmt::format("{:.1f} {:.1f}", window.x(q.x()), window.y(q.y()));
    };
    const bool goes_on = i > 0 && ends[i - 1] == ends[i];
    d += (goes_on ? "" : "M" + at(ends[i])) + "L" + at(ends[i + 1]);
  }
  return d;
}

std::string scale_bar(const PlanWindow& window) {
  const double rough = 0.2 * (window.max - window.min).x();
  const double power = std::pow(10.0, std::floor(std::log10(rough)));
  const double length = rough >= 5.0 * power   ? 5.0 * power
                        : rough >= 2.0 * power ? 2.0 * power
                                               : power;
  const double y = window.height() - 16.0;
  return fmt::format(
      "<g class=\"scale\"><path class=\"halo\" d=\"M14 {0:.1f}h{1:.1f}\"/><path class=\"bar\" "
      "d=\"M14 "
      "{0:.1f}h{1:.1f}\"/><text class=\"halo\" x=\"{2:.1f}\" y=\"{3:.1f}\">{4:g} m</text></g>",
      y, length * window.pixels_per_metre(), 20.0 + length * window.pixels_per_metre(), y + 4.0,
      length);
}

}  // namespace vantage::report
