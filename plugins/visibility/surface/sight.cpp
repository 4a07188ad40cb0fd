#include "sight.hpp"

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>
#include <numeric>

namespace vantage::surface {
namespace {

constexpr std::uint32_t kWhole = ~std::uint32_t{0};
constexpr float kPi = std::numbers::pi_v<float>;

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
constexpr float kFaintest = 0.01F;  // a smaller depth does not count
// What an optical depth takes from a size: one share at once, because there is seldom a gap in the
// right place, and little more for each further element, because none of them is certain [dB].
constexpr float kAtOnce = 15.0F, kFollowing = 2.5F, kHowSoon = 0.9F;

constexpr float kMargin = 0.1F;       // anything closer behind an element belongs to the same
                                      // surface [m]
constexpr float kDeepest = 20.0F;     // and so does what is in its plane and pixel, up to this
                                      // distance [m]
constexpr float kOpaque = 60.0F;      // optical depth
constexpr float kMostPixels = 20.0F;  // half a footprint, at most
constexpr float kNearest = 0.3F;      // nearer elements appear as if they were at this distance [m]
constexpr int kColumns = 720, kRows = kColumns / 2;           // of the image, half a degree each
constexpr double kPixel = 2.0 * std::numbers::pi / kColumns;  // [rad]
constexpr float kBin = 0.05F;                                 // of the distances that are sorted
                                                              // [m]

/// The angle of (x, y) in [-pi, pi], with an error below 1e-4, a tenth of what matters here.
float angle_of(float y, float x) noexcept {
  const float ax = std::abs(x), ay = std::abs(y);
  const float high = std::max(ax, ay);
  if (high == 0.0F) return 0.0F;
  const float t = std::min(ax, ay) / high, s = t * t;
  float angle = ((-0.0464964749F * s + 0.15931422F) * s - 0.327622764F) * s * t + t;
  if (ay > ax) angle = 0.5F * kPi - angle;
  if (x < 0.0F) angle = kPi - angle;
  return y < 0.0F ? -angle : angle;
}

/// The share of a size that an optical depth in front of it leaves.
float left_behind(float depth) noexcept {
  const float lost = kAtOnce * (1.0F - std::exp(-kHowSoon * depth)) + kFollowing * depth;  // [dB]
  return std::pow(10.0F, -0.1F * lost);
}

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

Sight::Sight(PointsView map, const Elements& elements, std::span<const Optics> optics,
             const Settings& settings)
    : map_(map),
      elements_(elements),
      optics_(optics),
      settings_(settings),
      image_(static_cast<std::size_t>(kColumns) * kRows) {
  reach_ = std::min(settings.max_range, std::sqrt(kArea * Elements::fullest() / settings.min_size));
}

Sight::Seen Sight::look(const Point& viewpoint,
                        const std::function<bool(std::uint32_t)>& is_known) {
  appearances_.clear();
  cut_.clear();
  cut_points_.clear();
  seen_elements_.clear();
  seen_points_.clear();
  std::fill(image_.begin(), image_.end(), 0.0F);

  const double radius = elements_.width() * std::numbers::sqrt3;  // of a cell, around its centre
  const double reach = reach_ + radius;
  // Points that are not looked at must not decide which part an element belongs to.
  bool is_at_point = false;
  elements_.around(viewpoint, radius, [&](std::uint32_t begin, std::uint32_t end) {
    for (const Element& element : elements_.all().subspan(begin, end - begin)) {
      if ((element.shape.centre - viewpoint).norm() > radius) continue;
      const auto points = elements_.points(element);
      is_at_point = is_at_point || std::any_of(points.begin(), points.end(), [&](std::uint32_t k) {
                      return map_[k] == viewpoint;
                    });
    }
  });
  const double farthest_known = settings_.max_range - elements_.reach_of_part();
  const double nearest_known = is_at_point ? elements_.reach_of_part() : 0.0;
  const auto look_at = [&](std::uint32_t number) {
    const Element& element = elements_.all()[number];
    const double distance = (element.shape.centre - viewpoint).norm();
    if (distance > reach) return;
    if (distance <= radius || distance + radius > settings_.max_range) {
      cut(number, viewpoint);
      return;
    }
    const bool is_part_known = distance >= nearest_known && distance <= farthest_known;
    appear(number, element.shape, optics_[number], is_part_known ? element.part : Part::structure,
           kWhole, viewpoint, !is_known || !is_known(number));
  };
  elements_.around(viewpoint, reach, [&](std::uint32_t begin, std::uint32_t end) {
    for (std::uint32_t number = begin; number < end; ++number) look_at(number);
  });

  sort_into_bins();
  // The points lie scattered in memory, and waiting for them takes a fifth of the time.
  constexpr std::size_t kAhead = 12;
  const auto fetch = [&](const std::vector<std::uint32_t>& order, std::size_t k) {
    if (k < order.size()) __builtin_prefetch(&appearances_[order[k]]);
  };
  for (std::size_t bin = 0; bin + 1 < reads_begin_.size(); ++bin) {
    for (std::uint32_t k = casts_begin_[bin]; k < casts_begin_[bin + 1]; ++k) {
      fetch(casts_, k + kAhead);
      cast(appearances_[casts_[k]]);
    }
    for (std::uint32_t k = reads_begin_[bin]; k < reads_begin_[bin + 1]; ++k) {
      fetch(reads_, k + kAhead);
      const Appearance& of = appearances_[reads_[k]];
      if (!(of.size * passed(of) >= static_cast<float>(settings_.min_size))) continue;
      if (of.cut == kWhole) {
        seen_elements_.push_back(of.element);
      } else {
        const Cut& points = cut_[of.cut];
        seen_points_.insert(seen_points_.end(), cut_points_.begin() + points.begin,
                            cut_points_.begin() + points.end);
      }
    }
  }
  return {seen_elements_, seen_points_};
}

/// Only the points at a distance in (0, max_range] take part; the shape, too, is computed from them
/// alone.
void Sight::cut(std::uint32_t element, const Point& viewpoint) {
  const auto begin = static_cast<std::uint32_t>(cut_points_.size());
  for (const std::uint32_t k : elements_.points(elements_.all()[element])) {
    const double distance = (map_[k] - viewpoint).norm();
    if (distance > 0.0 && distance <= settings_.max_range) cut_points_.push_back(k);
  }
  const auto end = static_cast<std::uint32_t>(cut_points_.size());
  if (begin == end) return;
  const Shape shape = elements_.measure(map_, std::span(cut_points_).subspan(begin, end - begin));
  cut_.push_back({begin, end});
  // Points that take no part may have decided the element's part.
  appear(element, shape, Optics::of(shape, elements_.width(), settings_.thickness), Part::structure,
         static_cast<std::uint32_t>(cut_.size() - 1), viewpoint, true);
}

void Sight::appear(std::uint32_t element, const Shape& shape, const Optics& optics, Part part,
                   std::uint32_t cut, const Point& viewpoint, bool is_wanted) {
  const Eigen::Vector3f offset = (shape.centre - viewpoint).cast<float>();
  const Eigen::Vector3f direction = offset.normalized();
  const float distance = std::max(offset.norm(), kNearest);
  const float cosine = std::abs(direction.dot(shape.axes.col(0)));
  const float sine2 = std::max(0.0F, 1.0F - cosine * cosine);

  float depth = optics.depth;
  if (part == Part::low) depth *= kLowDepth;
  if (part == Part::ground) depth *= kGroundDepth;
  float size = 0.0F;
  if (is_wanted) {
    size = optics.brightness / (distance * distance) *
           std::sqrt(cosine * cosine + optics.roughness * optics.roughness * sine2);
    if (part == Part::low) size *= kLowShown;
    if (size < static_cast<float>(settings_.min_size)) size = 0.0F;
  }
  if (size == 0.0F && depth < kFaintest) return;

  const auto pixel = static_cast<float>(kPixel);
  const float plan = direction.head<2>().norm();
  // Both have length 1, as the direction has.
  const Eigen::Vector3f right =
      plan > 1e-3F ? Eigen::Vector3f(-direction.y() / plan, direction.x() / plan, 0.0F)
                   : Eigen::Vector3f::UnitX();
  const Eigen::Vector3f up = direction.cross(right);
  const auto half = [&](const Eigen::Vector3f& across) {
    const float extent = (shape.axes.transpose() * across).cwiseAbs().dot(shape.extents);
    return std::min(0.5F * extent / (distance * pixel), kMostPixels);
  };
  const float in_plane =
      shape.is_flat ? 2.0F * pixel * distance * std::sqrt(sine2) / std::max(cosine, 0.03F) : 0.0F;
  appearances_.push_back({.element = element,
                          .cut = cut,
                          .azimuth = (angle_of(direction.y(), direction.x()) + kPi) / pixel,
                          .elevation = (angle_of(direction.z(), plan) + 0.5F * kPi) / pixel,
                          .half_width = std::min(half(right) / std::max(0.1F, plan),
                                                 0.45F * static_cast<float>(kColumns)),
                          .half_height = half(up),
                          .size = size,
                          .depth = depth < kFaintest ? 0.0F : depth,
                          .read_at = distance,
                          .cast_at = distance + kMargin + std::min(in_plane, kDeepest)});
}

/// Counting sort: within a bin, the order is that of the elements. Bins begin at the viewpoint, so
/// that they do not depend on the query.
void Sight::sort_into_bins() {
  const auto is_read = [](const Appearance& a) { return a.size > 0.0F; };
  float nearest = std::numeric_limits<float>::infinity(), farthest = 0.0F;
  for (const Appearance& a : appearances_) {
    if (a.depth > 0.0F) nearest = std::min(nearest, a.cast_at);
    if (!is_read(a)) continue;
    nearest = std::min(nearest, a.read_at);
    farthest = std::max(farthest, a.read_at);
  }
  const bool is_any_read = farthest > 0.0F;
  const auto number = [](float distance) { return static_cast<std::size_t>(distance / kBin); };
  // Bins before the first that is needed are left out: a viewpoint may be far from its map.
  const std::size_t first = is_any_read ? number(nearest) : 0;
  const auto bin = [&](float distance) { return number(distance) - first; };
  const std::size_t bins = is_any_read ? bin(farthest) + 1 : 0;
  const auto is_cast = [&](const Appearance& a) {
    return a.depth > 0.0F && bins > 0 && bin(a.cast_at) < bins;
  };
  reads_begin_.assign(bins + 2, 0);
  casts_begin_.assign(bins + 2, 0);
  for (const Appearance& a : appearances_) {
    if (is_read(a)) ++reads_begin_[bin(a.read_at) + 2];
    if (is_cast(a)) ++casts_begin_[bin(a.cast_at) + 2];
  }
  std::partial_sum(reads_begin_.begin(), reads_begin_.end(), reads_begin_.begin());
  std::partial_sum(casts_begin_.begin(), casts_begin_.end(), casts_begin_.begin());
  reads_.resize(reads_begin_.back());
  casts_.resize(casts_begin_.back());
  for (std::uint32_t k = 0; k < appearances_.size(); ++k) {
    const Appearance& a = appearances_[k];
    if (is_read(a)) reads_[reads_begin_[bin(a.read_at) + 1]++] = k;
    if (is_cast(a)) casts_[casts_begin_[bin(a.cast_at) + 1]++] = k;
  }
  reads_begin_.pop_back();
  casts_begin_.pop_back();
}

/// Calls visit(pixel, share of the pixel) for every pixel that an appearance covers; azimuths wrap
/// around.
template <class Visit>
void Sight::for_pixels(const Appearance& of, const Visit& visit) const {
  const float bottom = of.elevation - of.half_height, top = of.elevation + of.half_height;
  const float left = of.azimuth - of.half_width, right = of.azimuth + of.half_width;
  const int first_row = std::max(0, static_cast<int>(std::floor(bottom)));
  const int last_row = std::min(kRows - 1, static_cast<int>(std::floor(top)));
  const int first_column = static_cast<int>(std::floor(left));
  const int last_column = static_cast<int>(std::floor(right));
  for (int row = first_row; row <= last_row; ++row) {
    const auto y = static_cast<float>(row);
    const float height = std::min(y + 1.0F, top) - std::max(y, bottom);
    for (int column = first_column; column <= last_column; ++column) {
      const auto x = static_cast<float>(column);
      const float share = height * (std::min(x + 1.0F, right) - std::max(x, left));
      const int around =
          column < 0 ? column + kColumns : (column >= kColumns ? column - kColumns : column);
      visit(static_cast<std::size_t>(row * kColumns + around), share);
    }
  }
}

/// The share of an appearance's size that the elements in front of it leave.
float Sight::passed(const Appearance& of) const {
  float sum = 0.0F, covered = 0.0F;
  for_pixels(of, [&](std::size_t pixel, float share) {
    covered += share;
    if (image_[pixel] == 0.0F) {
      sum += share;
    } else if (image_[pixel] < kOpaque) {
      sum += share * std::exp(-image_[pixel]);
    }
  });
  // Around the viewpoint itself, in no direction.
  if (!(sum < covered)) return 1.0F;
  static const float least = left_behind(kOpaque);
  return sum > 0.0F ? left_behind(std::min(-std::log(sum / covered), kOpaque)) : least;
}

void Sight::cast(const Appearance& of) {
  for_pixels(of, [&](std::size_t pixel, float share) { image_[pixel] += share * of.depth; });
}

}  // namespace vantage::surface
