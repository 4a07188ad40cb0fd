// What the rays of a virtual scan hit.
#include <algorithm>
#include <array>
#include <bit>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <limits>
#include <numbers>
#include <span>
#include <utility>
#include <vector>

#include "build/surfaces.hpp"
#include "build/view_windows.hpp"

namespace vantage {
namespace {

constexpr double kRadiansADegree = std::numbers::pi / 180.0;
constexpr std::size_t kRings = 20, kColumns = 360;
constexpr double kNone = std::numeric_limits<double>::infinity();
// Discs overlap. The nearest one along the ray would be off towards the sensor.
constexpr double kSameSurface = 0.3;  // [m]

}  // namespace

/// The directions of a scan's rays, and how far each has been followed. Rays are numbered column by
/// column.
class Surfaces::Raster {
 public:
  /// Some of the rays.
  struct Window {
    std::uint32_t rings;     // a bit for each
    std::int32_t from, end;  // columns; they count on beyond a turn
  };
  /// Precondition: it is not empty.
  [[nodiscard]] static Window window_of(const view::Windows& windows, std::size_t lane) {
    const auto first = static_cast<unsigned>(windows.ring[lane]);
    const auto last = static_cast<unsigned>(windows.last_ring[lane]);
    return {(2U << last) - (1U << first), windows.column[lane], windows.last_column[lane] + 1};
  }

  explicit Raster(const Rays& rays)
      : lowest_(static_cast<float>(rays.lowest * kRadiansADegree)),
        nearest_(kRings * kColumns, kNone) {
    const double step =
        std::max((rays.highest - rays.lowest) * kRadiansADegree / (kRings - 1), 1e-6);
    rings_a_radian_ = static_cast<float>(1.0 / step);
    for (std::size_t r = 0; r < kRings; ++r) {
      const double elevation = rays.lowest * kRadiansADegree + static_cast<double>(r) * step;
      ring_[r] = {std::cos(elevation), std::sin(elevation)};
    }
    for (std::size_t c = 0; c < kColumns; ++c) {
      const double azimuth = static_cast<double>(c) * kColumnStep;
      column_[c] = {std::cos(azimuth), std::sin(azimuth)};
    }
    open_.fill((1U << kRings) - 1);
  }

  [[nodiscard]] Point direction(std::size_t column, std::size_t ring) const {
    const auto& [cosine, sine] = ring_[ring];
    const auto& [x, y] = column_[column];
    return {cosine * x, cosine * y, sine};
  }
  [[nodiscard]] double nearest(std::size_t ray) const { return nearest_[ray]; }
  void meets(std::size_t ray, double range) { nearest_[ray] = std::min(nearest_[ray], range); }
  /// Everything from now on lies at least so far away: a ray that has met a surface before it is
  /// closed.
  void go_on_from(double range) { from_ = range; }

  /// The rays that may meet things, and a few others near them.
  [[nodiscard]] view::Windows windows_of(const view::Extents& seen) const {
    using view::floats, view::Floats, view::kAngleError;
    const auto ring = [&](Floats elevation) {  // counts from 1
      const Floats r = (elevation - lowest_) * rings_a_radian_ + 1.0F;
      const Floats inside = view::smaller(view::larger(r, floats(0.0F)), floats(float{kRings}));
      return __builtin_convertvector(inside, view::Ints);
    };
    const auto column = [&](Floats azimuth) {  // counts from 1, a turn later
      return __builtin_convertvector(azimuth * kColumnsARadian + float{kColumns + 1}, view::Ints);
    };
    const Floats sideways = view::smaller(seen.sideways + kAngleError, floats(view::kHalfTurn));
    return {.ring = ring(seen.low - kAngleError),
            .last_ring = ring(seen.high + kAngleError) - 1,
            .column = column(seen.azimuth - sideways),
            .last_column = column(seen.azimuth + sideways) - 1};
  }

  /// Calls use(column, ring) for the open rays of a window until it returns true.
  /// @return  whether it returned true
  template <class Use>
  bool any_open(const Window& window, const Use& use) {
    auto c = static_cast<std::size_t>(window.from);
    if (c >= kColumns) c -= kColumns;
    for (auto left = window.end - window.from; left > 0; --left) {
      for (std::uint32_t bits = open_[c] & window.rings; bits != 0; bits &= bits - 1) {
        const auto ring = static_cast<std::size_t>(std::countr_zero(bits));
        const std::size_t ray = c * kRings + ring;
        if (nearest_[ray] + kSameSurface < from_) {
          open_[c] &= ~(bits & (0U - bits));
        } else if (use(c, ring)) {
          return true;
        }
      }
      if (++c == kColumns) c = 0;
    }
    return false;
  }

 private:
  static constexpr double kColumnStep = 2.0 * std::numbers::pi / kColumns;
  static constexpr auto kColumnsARadian = static_cast<float>(1.0 / kColumnStep);

  float lowest_, rings_a_radian_ = 0.0F;
  double from_ = 0.0;
  std::array<std::pair<double, double>, kRings> ring_;      // cosine and sine
  std::array<std::pair<double, double>, kColumns> column_;  // the same
  std::array<std::uint32_t, kColumns> open_{};              // a bit for each ring
  std::vector<double> nearest_;                             // surface along each ray [m]
};

/// Follows the rays of one scan.
class Surfaces::Follower {
 public:
  Follower(const Surfaces& all, const Point& sensor, const Rays& rays)
      : all_(all),
        sensor_(sensor),
        range_(std::min(rays.max_range, kFarthestReturn)),
        raster_(rays) {
    meetings_.reserve(2 * kRings * kColumns);
  }

  void follow() {
    find_cubes();
    if (near_.empty()) return;
    const auto steps = static_cast<std::size_t>(range_ * kStepsAMetre) + 1;
    const auto step_of = [&](std::uint32_t k) {
      return static_cast<std::size_t>(near_[k].from * kStepsAMetre);
    };
    const Groups order = grouped(
        near_.size(), steps, [](std::size_t k) { return static_cast<std::uint32_t>(k); }, step_of);
    for (std::size_t at = 0; at < order.members.size(); at += kLanes) {
      const auto left = std::span(order.members).subspan(at);
      const auto some = left.first(std::min(kLanes, left.size()));
      const view::Windows windows = raster_.windows_of(view::extents_of(boxes_of(some)));
      const view::Ints filled = windows.filled();
      for (std::size_t lane = 0; lane < some.size(); ++lane) {
        if (filled[lane] == 0) continue;
        raster_.go_on_from(static_cast<double>(step_of(some[lane])) / kStepsAMetre);
        if (raster_.any_open(Raster::window_of(windows, lane),
                             [](std::size_t, std::size_t) { return true; })) {
          meet(near_[some[lane]]);
        }
      }
    }
  }

  [[nodiscard]] PointCloud hits() const {
    PointCloud hits;
    for (const std::uint32_t i : first_meetings()) {
      if (i != kNothing) hits.push_back(hit_of(meetings_[i]));
    }
    return hits;
  }

  [[nodiscard]] PointCloud scan() const {
    const std::vector<std::uint32_t> first = first_meetings();
    struct Sum {
      Point hits = Point::Zero();
      int count = 0;
    };
    std::vector<Sum> sums(first.size());  // of each disc, at its first ray
    std::uint32_t disc = kNothing;
    std::uint16_t ray = 0;
    for (std::uint32_t i = 0; i < meetings_.size(); ++i) {  // those of a disc one after the other
      const Meeting& m = meetings_[i];
      if (first[m.ray] != i) continue;
      if (m.disc != disc) ray = m.ray;
      disc = m.disc;
      sums[ray].hits += hit_of(m);
      ++sums[ray].count;
    }
    PointCloud scan;
    for (const Sum& sum : sums) {
      if (sum.count > 0) scan.push_back(sum.hits / sum.count);
    }
    return scan;
  }

 private:
  static constexpr float kStepsAMetre = 8.0F;
  static constexpr std::uint32_t kNothing = ~std::uint32_t{0};
  /// A cube near the sensor.
  struct Near {
    Eigen::Vector3f to;  // its middle [m]
    float from;          // nothing in it is nearer [m]
    std::uint32_t cube;
  };
  struct Meeting {
    double range, off;  // off: squared distance from the disc's middle
    std::uint32_t disc;
    std::uint16_t ray;
    bool flat;
  };

  /// Of each ray.
  [[nodiscard]] std::vector<std::uint32_t> first_meetings() const {
    std::vector<std::uint32_t> first(kRings * kColumns, kNothing);
    for (std::uint32_t i = 0; i < meetings_.size(); ++i) {
      const Meeting& m = meetings_[i];
      if (m.range > raster_.nearest(m.ray) + kSameSurface) continue;
      std::uint32_t& of_ray = first[m.ray];
      // Equal ones: the order of discs is the same in every map, that of cubes is not.
      if (of_ray == kNothing ||
          std::pair(m.off, m.disc) < std::pair(meetings_[of_ray].off, meetings_[of_ray].disc)) {
        of_ray = i;
      }
    }
    return first;
  }
  [[nodiscard]] Point hit_of(const Meeting& m) const {
    if (!m.flat) return all_.middles_[m.disc];
    return sensor_ + m.range * raster_.direction(m.ray / kRings, m.ray % kRings);
  }

  void find_cubes() {
    const Eigen::Vector2d side = Eigen::Vector2d::Constant(range_ + double{all_.widest_});
    const Eigen::Vector2d low = sensor_.head<2>() - side, high = sensor_.head<2>() + side;
    for (const std::uint32_t k : all_.plan_->near(low, high)) {
      const Eigen::Vector3f to = (all_.cube_middles_[k] - sensor_).cast<float>();
      const float from = (to.array().abs() - all_.cubes_[k].half.array()).max(0.0F).matrix().norm();
      if (double{from} <= range_) near_.push_back({to, from, k});
    }
  }
  [[nodiscard]] view::Boxes boxes_of(std::span<const std::uint32_t> some) const {
    view::Boxes boxes{};
    for (std::size_t lane = 0; lane < some.size(); ++lane) {
      const Near& near = near_[some[lane]];
      const Eigen::Vector3f& half = all_.cubes_[near.cube].half;
      boxes.x[lane] = near.to.x();
      boxes.y[lane] = near.to.y();
      boxes.z[lane] = near.to.z();
      boxes.half_x[lane] = half.x();
      boxes.half_y[lane] = half.y();
      boxes.half_z[lane] = half.z();
    }
    return boxes;
  }
  [[nodiscard]] static view::Discs seen(const Discs& discs, const Eigen::Vector3f& cube) {
    using view::floats;
    return {.x = floats(discs.x) + cube.x(),
            .y = floats(discs.y) + cube.y(),
            .z = floats(discs.z) + cube.z(),
            .normal_x = floats(discs.normal_x),
            .normal_y = floats(discs.normal_y),
            .normal_z = floats(discs.normal_z),
            .radius = floats(discs.radius)};
  }

  void meet(const Near& near) {
    const Cube& cube = all_.cubes_[near.cube];
    windows_.resize(cube.end - cube.begin);
    with_rays_.resize(kLanes * windows_.size());
    std::size_t count = 0;
    for (std::uint32_t k = 0; k < windows_.size(); ++k) {
      const Point* const middles = &all_.middles_[kLanes * (cube.begin + k)];
      __builtin_prefetch(middles);  // some of them will be read soon
      __builtin_prefetch(middles + kLanes - 1);
      const view::Discs discs = seen(all_.discs_[cube.begin + k], near.to);
      windows_[k] = raster_.windows_of(view::extents_of(discs));
      const view::Ints filled = windows_[k].filled();
      for (std::uint32_t lane = 0; lane < kLanes; ++lane) {  // without branches
        with_rays_[count] = static_cast<std::uint32_t>(kLanes) * k + lane;
        count += filled[lane] == 0 ? 0 : 1;
      }
    }
    for (std::size_t i = 0; i < count; ++i) {
      const std::uint32_t k = with_rays_[i];
      meet(kLanes * cube.begin + k, Raster::window_of(windows_[k / kLanes], k % kLanes));
    }
  }

  void meet(std::size_t k, const Raster::Window& window) {
    constexpr double kNearest = 1.0, kGrazing = 0.02;  // [m], sine of the angle to the surface
    const Discs& discs = all_.discs_[k / kLanes];
    const std::size_t lane = k % kLanes;
    const Point to = all_.middles_[k] - sensor_;
    const double away = to.norm(), radius = discs.radius[lane];
    if (away > range_ || away < radius) return;
    const Point normal(discs.normal_x[lane], discs.normal_y[lane], discs.normal_z[lane]);
    const bool flat = normal != Point::Zero();
    const double height = normal.dot(to);
    raster_.any_open(window, [&](std::size_t column, std::size_t ring) {
      const Point direction = raster_.direction(column, ring);
      const std::size_t ray = column * kRings + ring;
      double at = away;
      if (flat) {
        const double towards = normal.dot(direction);
        if (std::abs(towards) < kGrazing) return false;
        at = height / towards;
      }
      const double behind = raster_.nearest(ray) + kSameSurface;
      if (!(at >= kNearest && at <= std::min(range_, behind))) return false;
      const double off = (at * direction - to).squaredNorm();
      if (off > radius * radius) return false;
      raster_.meets(ray, at);
      meetings_.push_back(
          {at, off, static_cast<std::uint32_t>(k), static_cast<std::uint16_t>(ray), flat});
      return false;
    });
  }

  const Surfaces& all_;
  const Point sensor_;
  const double range_;
  Raster raster_;
  std::vector<Near> near_;
  std::vector<view::Windows> windows_;    // of the discs of one cube
  std::vector<std::uint32_t> with_rays_;  // those of them that have rays
  std::vector<Meeting> meetings_;
};

PointCloud Surfaces::hits(const Point& sensor, const Rays& rays) const {
  Follower follower(*this, sensor, rays);
  follower.follow();
  return follower.hits();
}

PointCloud Surfaces::scan(const Point& sensor, const Rays& rays) const {
  Follower follower(*this, sensor, rays);
  follower.follow();
  return follower.scan();
}

}  // namespace vantage
