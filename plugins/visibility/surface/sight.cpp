#include "sight.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>
#include <numeric>

// Compiled twice: for eight numbers at a time where the processor can, else for four. Neither fuses
// operations, so both give the same numbers.
// Sanitizers cannot watch the choice between them.
#if defined(__x86_64__) && defined(__GNUC__) && !defined(__clang__) && \
    !defined(__SANITIZE_THREAD__) && !defined(__SANITIZE_ADDRESS__)
#define VANTAGE_WIDE __attribute__((target_clones("avx2", "default")))
#define VANTAGE_INLINE inline __attribute__((always_inline))
#else
#define VANTAGE_WIDE
#define VANTAGE_INLINE inline
#endif

namespace vantage::surface {
namespace {

constexpr std::uint32_t kNone = ~std::uint32_t{0};
constexpr float kPi = std::numbers::pi_v<float>;

constexpr float kFaintest = 0.01F;    // a smaller depth does not count
constexpr float kMargin = 0.1F;       // anything closer behind an element belongs to the same
                                      // surface [m]
constexpr float kDeepest = 20.0F;     // and so does what is in its plane and pixel, up to this
                                      // distance [m]
constexpr float kMostPixels = 20.0F;  // half a footprint, at most
constexpr float kNearest = 0.3F;      // nearer elements appear as if they were at this distance [m]
constexpr float kBin = 0.05F;         // of the distances that are sorted [m]
constexpr auto kPixel = static_cast<float>(Image::kPixel);
constexpr auto kColumns = static_cast<float>(Image::kColumns);

// What is deeper than the depth behind which nothing is seen by this much need not hide more: so
// the part of an element that is hidden counts as hidden.
constexpr float kSpareDepth = 1.0F;
// How often that depth is found anew: whenever the distance has grown by this factor.
constexpr float kAnew = 1.3F;

/// The angle of (x, y) in [-pi, pi], with an error below 1e-4, a tenth of what matters here.
VANTAGE_INLINE float angle_of(float y, float x) noexcept {
  const float ax = std::abs(x), ay = std::abs(y);
  const float high = std::max(std::max(ax, ay), 1e-30F);
  const float t = std::min(ax, ay) / high, s = t * t;
  const float low = ((-0.0464964749F * s + 0.15931422F) * s - 0.327622764F) * s * t + t;
  const float turned = 0.5F * kPi - low, quarter = ay > ax ? turned : low;
  const float other = kPi - quarter, half = x < 0.0F ? other : quarter;
  return std::copysign(half, y);
}

float azimuth_of(float y, float x) { return (angle_of(y, x) + kPi) / kPixel; }
float elevation_of(float z, float plan) { return (angle_of(z, plan) + 0.5F * kPi) / kPixel; }

}  // namespace

double Settings::reach() const noexcept {
  return std::min(max_range, std::sqrt(brightest() / min_size));
}

/// Lanes of a batch, each an element.
struct Sight::Appearances {
  static constexpr std::size_t kLanes = 64;
  template <class T>
  using Lanes = std::array<T, kLanes>;

  Lanes<float> left, right, bottom, top, size, depth, distance, behind;

  /// @param at        the block's corner, from the viewpoint [m]
  /// @param from, to  parts of the scene are known at these distances [m]
  VANTAGE_WIDE void compute(const Blocks& blocks, std::uint32_t begin, std::size_t n,
                            const Eigen::Vector3f& at, float from, float to);
  /// The same for one shape.
  void compute(const Shape& shape, const Optics& optics, const Eigen::Vector3f& offset);
};

namespace {

/// What is known of one element, whatever the viewpoint; as `Field`.
struct Facet {
  float x, y, z, normal_x, normal_y, normal_z, extent, first_x, first_y, first_z, second_x,
      second_y, second_z, flat, roughness, brightness, depth;
};

/// Sets lane i of `to`. @param f  with its centre from the viewpoint
template <class Lanes>
VANTAGE_INLINE void appear(Lanes& to, std::size_t i, const Facet& f) noexcept {
  const float length = std::sqrt(f.x * f.x + f.y * f.y + f.z * f.z);
  const float inverse = 1.0F / std::max(length, 1e-12F);
  const float x = f.x * inverse, y = f.y * inverse, z = f.z * inverse;
  const float distance = std::max(length, kNearest);
  const float cosine = std::abs(x * f.normal_x + y * f.normal_y + z * f.normal_z);
  const float sine2 = std::max(0.0F, 1.0F - cosine * cosine);
  to.size[i] = f.brightness / (distance * distance) *
               std::sqrt(cosine * cosine + f.roughness * f.roughness * sine2);
  to.depth[i] = f.depth < kFaintest ? 0.0F : f.depth;

  const float plan = std::sqrt(x * x + y * y);
  // Both have length 1, as the direction has.
  const float flat = std::max(plan, 1e-3F);
  const float across_x = -y / flat, across_y = x / flat;
  const float right_x = plan > 1e-3F ? across_x : 1.0F, right_y = plan > 1e-3F ? across_y : 0.0F;
  const float up_x = -z * right_y, up_y = z * right_x, up_z = x * right_y - y * right_x;
  const float wide = f.extent * std::abs(f.normal_x * right_x + f.normal_y * right_y) +
                     std::abs(f.first_x * right_x + f.first_y * right_y) +
                     std::abs(f.second_x * right_x + f.second_y * right_y);
  const float tall =
      f.extent * std::abs(f.normal_x * up_x + f.normal_y * up_y + f.normal_z * up_z) +
      std::abs(f.first_x * up_x + f.first_y * up_y + f.first_z * up_z) +
      std::abs(f.second_x * up_x + f.second_y * up_y + f.second_z * up_z);
  const float pixels = 0.5F / (distance * kPixel);
  const float half_width =
      std::min(std::min(wide * pixels, kMostPixels) / std::max(0.1F, plan), 0.45F * kColumns);
  const float half_height = std::min(tall * pixels, kMostPixels);
  const float azimuth = (angle_of(y, x) + kPi) / kPixel;
  const float elevation = (angle_of(z, plan) + 0.5F * kPi) / kPixel;
  to.left[i] = azimuth - half_width;
  to.right[i] = azimuth + half_width;
  to.bottom[i] = elevation - half_height;
  to.top[i] = elevation + half_height;
  const float in_plane =
      f.flat * (2.0F * kPixel * distance * std::sqrt(sine2) / std::max(cosine, 0.03F));
  to.distance[i] = distance;
  to.behind[i] = distance + kMargin + std::min(in_plane, kDeepest);
}

}  // namespace

VANTAGE_WIDE void Sight::Appearances::compute(const Blocks& blocks, std::uint32_t begin,
                                              std::size_t n, const Eigen::Vector3f& at, float from,
                                              float to) {
  const auto field = [&](Field of) { return blocks.field(of) + begin; };
  const float
      *const xs = field(Field::x),
             *const ys = field(Field::y), *const zs = field(Field::z),
             *const normal_x = field(Field::normal_x), *const normal_y = field(Field::normal_y),
             *const normal_z = field(Field::normal_z), *const extent = field(Field::extent),
             *const first_x = field(Field::first_x), *const first_y = field(Field::first_y),
             *const first_z = field(Field::first_z), *const second_x = field(Field::second_x),
             *const second_y = field(Field::second_y), *const second_z = field(Field::second_z),
             *const flat = field(Field::flat), *const roughness = field(Field::roughness),
             *const brightness = field(Field::brightness), *const depths = field(Field::depth),
             *const bare_brightness = field(Field::bare_brightness),
             *const bare_depth = field(Field::bare_depth);
  const float at_x = at.x(), at_y = at.y(), at_z = at.z();
#pragma GCC ivdep
  for (std::size_t i = 0; i < n; ++i) {
    const float x = at_x + xs[i], y = at_y + ys[i], z = at_z + zs[i];
    const float d2 = x * x + y * y + z * z;
    const bool is_part_known = (d2 >= from * from) & (d2 <= to * to);
    const float part_brightness = brightness[i], bare = bare_brightness[i];
    const float part_depth = depths[i], hiding = bare_depth[i];
    appear(*this, i,
           Facet{x, y, z, normal_x[i], normal_y[i], normal_z[i], extent[i], first_x[i], first_y[i],
                 first_z[i], second_x[i], second_y[i], second_z[i], flat[i], roughness[i],
                 is_part_known ? part_brightness : bare, is_part_known ? part_depth : hiding});
  }
}

void Sight::Appearances::compute(const Shape& shape, const Optics& optics,
                                 const Eigen::Vector3f& offset) {
  const Eigen::Matrix3f sides = shape.axes * shape.extents.asDiagonal();
  appear(*this, 0,
         Facet{offset.x(), offset.y(), offset.z(), shape.axes(0, 0), shape.axes(1, 0),
               shape.axes(2, 0), shape.extents[0], sides(0, 1), sides(1, 1), sides(2, 1),
               sides(0, 2), sides(1, 2), sides(2, 2), shape.is_flat ? 1.0F : 0.0F, optics.roughness,
               optics.brightness, optics.depth});
}

Sight::Sight(PointsView map, const Elements& elements, const Blocks& blocks,
             const Settings& settings)
    : map_(map),
      elements_(elements),
      blocks_(blocks),
      settings_(settings),
      radius_(elements.width() * std::numbers::sqrt3),
      reach_(settings.reach() + radius_),
      min_size_(static_cast<float>(settings.min_size)) {}

std::span<const std::uint32_t> Sight::look(const Point& viewpoint, Known& known) {
  appearances_.clear();
  cut_.clear();
  cut_points_.clear();
  seen_points_.clear();
  image_.clear();
  gather(viewpoint, known);
  if (!nears_.empty()) {
    sort_by_distance();
    sweep(viewpoint, known);
  }
  return seen_points_;
}

void Sight::gather(const Point& viewpoint, const Known& known) {
  nears_.clear();
  is_at_point_ = false;
  const auto reach = static_cast<float>(reach_), radius = static_cast<float>(radius_);
  const auto width = static_cast<float>(blocks_.width());
  // Of a block that is not all within range, only the place counts: not the elements beyond.
  const double all_within = settings_.max_range - 2.0 * radius_;
  for (const Blocks::Row& row : blocks_.rows_around(viewpoint, viewpoint, reach_)) {
    for (std::uint32_t k = row.begin; k < row.end; ++k) {
      const Block& block = blocks_.all()[k];
      const Eigen::Vector3f at = (blocks_.corner(block) - viewpoint).cast<float>();
      Near near{
          .block = k, .shift = known.shift(row.x), .distance = 0, .far = 0, .low = {}, .high = {}};
      const auto box = [&](const auto& low, const auto& high) {
        float nearest2 = 0.0F, farthest2 = 0.0F;
        for (std::size_t axis = 0; axis < 3; ++axis) {
          const float from = at[static_cast<Eigen::Index>(axis)];
          near.low[axis] = from + low(axis);
          near.high[axis] = from + high(axis);
          const float off = std::max({0.0F, near.low[axis], -near.high[axis]});
          const float most = std::max(-near.low[axis], near.high[axis]);
          nearest2 += off * off;
          farthest2 += most * most;
        }
        near.distance = std::sqrt(nearest2);
        near.far = std::sqrt(farthest2);
      };
      box([&](std::size_t) { return -radius; }, [&](std::size_t) { return width + radius; });
      if (near.distance > reach) continue;
      if (near.far <= all_within) {
        box([&](std::size_t axis) { return block.low[axis]; },
            [&](std::size_t axis) { return block.high[axis]; });
        if (near.distance > reach) continue;
      }
      nears_.push_back(near);
      if (near.distance > radius) continue;
      for (std::uint32_t e = block.begin; e < block.end; ++e) {
        const Element& element = elements_.all()[blocks_.number(e)];
        if ((element.shape.centre - viewpoint).norm() > radius_) continue;
        const auto points = elements_.points(element);
        is_at_point_ = is_at_point_ || std::any_of(points.begin(), points.end(),
                                                   [&](auto p) { return map_[p] == viewpoint; });
      }
    }
  }
}

std::size_t Sight::bin_of(float distance) const noexcept {
  const float offset = std::max(0.0F, distance - nearest_);
  return static_cast<std::size_t>(offset / kBin);
}

/// Counting sort: within a bin, the order is that of the blocks. Bins begin where the first block
/// does: a viewpoint may be far from its map.
void Sight::sort_by_distance() {
  nearest_ = std::numeric_limits<float>::infinity();
  float farthest = 0.0F;
  for (const Near& near : nears_) {
    nearest_ = std::min(nearest_, near.distance);
    farthest = std::max(farthest, near.far);
  }
  // In multiples of a bin from the viewpoint, so that they do not depend on what is nearest.
  nearest_ = kBin * std::floor(nearest_ / kBin);
  const std::size_t bins = bin_of(std::min(farthest, static_cast<float>(reach_))) + 2;
  bins_.assign(bins, {kNone, kNone});
  order_begin_.assign(bins + 2, 0);
  for (const Near& near : nears_) ++order_begin_[bin_of(near.distance) + 2];
  std::partial_sum(order_begin_.begin(), order_begin_.end(), order_begin_.begin());
  order_.resize(nears_.size());
  for (std::uint32_t k = 0; k < nears_.size(); ++k) {
    order_[order_begin_[bin_of(nears_[k].distance) + 1]++] = k;
  }
}

void Sight::sweep(const Point& viewpoint, Known& known) {
  float highest = 0.0F;  // above or below the viewpoint [m]
  for (const Near& near : nears_) {
    highest = std::max({highest, near.high[2], -near.low[2]});
  }
  float anew = std::max(nearest_, 4.0F);
  for (bin_ = 0; bin_ < bins_.size(); ++bin_) {
    const std::uint32_t begin = order_begin_[bin_], end = order_begin_[bin_ + 1];
    const float distance = nearest_ + static_cast<float>(bin_) * kBin;
    if (begin < end && distance >= anew) {
      const float surplus =
          10.0F * std::log10(static_cast<float>(brightest()) / (distance * distance) / min_size_);
      const float plan = std::sqrt(std::max(0.0F, distance * distance - highest * highest));
      image_.hide_behind(depth_that_takes(surplus) + kSpareDepth,
                         elevation_of(-highest, plan) - 1.0F, elevation_of(highest, plan) + 1.0F);
      anew = kAnew * distance;
    }
    for (std::uint32_t k = begin; k < end; ++k) {
      const Near& near = nears_[order_[k]];
      if (!is_hidden(near)) expand(near, viewpoint, known);
    }
    for (std::uint32_t k = bins_[bin_].cast; k != kNone;) {
      const Appearance& of = appearances_[k];
      k = of.next_cast;
      if (k != kNone) __builtin_prefetch(&appearances_[k]);
      if (!image_.hides(of.footprint)) image_.cast(of.footprint, of.depth);
    }
    for (std::uint32_t k = bins_[bin_].read; k != kNone;) {
      const Appearance& of = appearances_[k];
      k = of.next_read;
      if (k != kNone) __builtin_prefetch(&appearances_[k]);
      if (image_.hides(of.footprint)) continue;
      if (!(of.size * image_.passed(of.footprint) >= min_size_)) continue;
      if (!of.is_cut) {
        known.see(of.place);
      } else {
        const Cut& points = cut_[of.place];
        seen_points_.insert(seen_points_.end(), cut_points_.begin() + points.begin,
                            cut_points_.begin() + points.end);
      }
    }
  }
}

/// Whether nothing of a block can be seen, and what it hides is hidden already.
bool Sight::is_hidden(const Near& near) const {
  const float x = 0.5F * (near.low[0] + near.high[0]), y = 0.5F * (near.low[1] + near.high[1]);
  const float half = 0.5F * std::hypot(near.high[0] - near.low[0], near.high[1] - near.low[1]);
  const float plan = std::hypot(x, y);
  const float low = near.low[2], high = near.high[2];
  if (plan < 2.0F * half || std::max(high, -low) > plan) return false;
  constexpr float kRound = 0.1F;  // [pixels]
  const float azimuth = azimuth_of(y, x);
  const float width = half / std::sqrt(plan * plan - half * half) / kPixel + kRound;
  return image_.hides(
      {.left = azimuth - width,
       .right = azimuth + width,
       .bottom = elevation_of(low, low > 0.0F ? plan + half : plan - half) - kRound,
       .top = elevation_of(high, high > 0.0F ? plan - half : plan + half) + kRound});
}

void Sight::expand(const Near& near, const Point& viewpoint, const Known& known) {
  const Block& block = blocks_.all()[near.block];
  const Eigen::Vector3f at = (blocks_.corner(block) - viewpoint).cast<float>();
  const double farthest_known = settings_.max_range - elements_.reach_of_part();
  const double nearest_known = is_at_point_ ? elements_.reach_of_part() : 0.0;
  const auto whole_to = static_cast<float>(settings_.max_range - radius_);
  const auto radius = static_cast<float>(radius_), reach = static_cast<float>(reach_);
  const bool is_whole = near.distance > radius && near.far <= whole_to && near.far <= reach;
  Appearances of;
  for (std::uint32_t begin = block.begin; begin < block.end; begin += Appearances::kLanes) {
    const std::size_t n = std::min<std::size_t>(Appearances::kLanes, block.end - begin);
    of.compute(blocks_, begin, n, at, static_cast<float>(nearest_known),
               farthest_known < 0.0 ? -1.0F : static_cast<float>(farthest_known));
    for (std::uint32_t i = 0; i < n; ++i) {
      if (!is_whole) {
        const double distance =
            (elements_.all()[blocks_.number(begin + i)].shape.centre - viewpoint).norm();
        if (distance > reach_) continue;
        if (distance <= radius_ || distance + radius_ > settings_.max_range) {
          cut(begin + i, viewpoint);
          continue;
        }
      }
      const std::uint32_t place = begin + i + near.shift;
      if (of.size[i] < min_size_ || known.is_seen(place)) of.size[i] = 0.0F;
      if (of.size[i] == 0.0F && of.depth[i] == 0.0F) continue;
      if (image_.hides({of.left[i], of.right[i], of.bottom[i], of.top[i]})) continue;
      add(of, i, place, false);
    }
  }
}

void Sight::add(const Appearances& of, std::size_t lane, std::uint32_t place, bool is_cut) {
  Appearance appearance{.footprint = {.left = of.left[lane],
                                      .right = of.right[lane],
                                      .bottom = of.bottom[lane],
                                      .top = of.top[lane]},
                        .place = place,
                        .is_cut = is_cut,
                        .size = of.size[lane],
                        .depth = of.depth[lane],
                        .next_read = kNone,
                        .next_cast = kNone};
  const auto number = static_cast<std::uint32_t>(appearances_.size());
  if (appearance.size > 0.0F) {
    const std::size_t bin = std::max(bin_, std::min(bin_of(of.distance[lane]), bins_.size() - 1));
    appearance.next_read = bins_[bin].read;
    bins_[bin].read = number;
  }
  const std::size_t bin = std::max(bin_, bin_of(of.behind[lane]));
  if (appearance.depth > 0.0F && bin < bins_.size()) {
    appearance.next_cast = bins_[bin].cast;
    bins_[bin].cast = number;
  }
  appearances_.push_back(appearance);
}

/// Only the points at a distance in (0, max_range] take part; the shape, too, is computed from them
/// alone.
void Sight::cut(std::uint32_t element, const Point& viewpoint) {
  const auto begin = static_cast<std::uint32_t>(cut_points_.size());
  for (const std::uint32_t k : elements_.points(elements_.all()[blocks_.number(element)])) {
    const double distance = (map_[k] - viewpoint).norm();
    if (distance > 0.0 && distance <= settings_.max_range) cut_points_.push_back(k);
  }
  const auto end = static_cast<std::uint32_t>(cut_points_.size());
  if (begin == end) return;
  const Shape shape = elements_.measure(map_, std::span(cut_points_).subspan(begin, end - begin));
  // Points that take no part may have decided the element's part.
  Appearances of;
  of.compute(shape, Optics::of(shape, elements_.width(), settings_.thickness),
             (shape.centre - viewpoint).cast<float>());
  if (of.size[0] < min_size_) of.size[0] = 0.0F;
  if (of.size[0] == 0.0F && of.depth[0] == 0.0F) return;
  cut_.push_back({begin, end});
  add(of, 0, static_cast<std::uint32_t>(cut_.size() - 1), true);
}

}  // namespace vantage::surface
