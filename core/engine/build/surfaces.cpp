#include "build/surfaces.hpp"

#include <tbb/parallel_for.h>

#include <Eigen/Eigenvalues>
#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <limits>
#include <numbers>
#include <optional>
#include <span>
#include <utility>

#include "vantage/kit/hash.hpp"

namespace vantage {
namespace {

constexpr double kEdge = 0.4;             // of a voxel [m]
constexpr std::int64_t kTile = 40;        // voxels along a tile's side
constexpr std::size_t kMostTiles = 4096;  // along one axis
constexpr double kDegree = std::numbers::pi / 180.0;

std::int64_t voxel_along(double x) { return static_cast<std::int64_t>(std::floor(x / kEdge)); }

/// Distinct for the voxels within 800 km of each other. Neighbours above each other have
/// consecutive keys.
std::uint64_t voxel_of(const Point& p) {
  constexpr std::uint64_t kMask = (1U << 21U) - 1;
  constexpr std::int64_t kMiddle = 1 << 20U;  // keys begin anew far below and above the ground
  const auto part = [](double x) {
    return static_cast<std::uint64_t>(voxel_along(x) + kMiddle) & kMask;
  };
  return part(p.x()) << 42U | part(p.y()) << 21U | part(p.z());
}

constexpr std::int64_t kCube = 8;  // voxels along the edge of a cube

/// The key of the cube that a voxel lies in.
std::uint64_t cube_of(std::uint64_t voxel) {
  constexpr std::uint64_t kPart = ((1U << 21U) - 1) & ~std::uint64_t{kCube - 1};
  return voxel & (kPart << 42U | kPart << 21U | kPart);
}

float no_less_than_asin(float x) { return x < 0.5F ? 1.05F * x : std::asin(std::min(x, 1.0F)); }

/// To within kAtanError: atan2(y, x) by a polynomial for the angle to the nearer axis.
constexpr float kAtanError = 3e-4F;  // [rad]
float about_atan2(float y, float x) {
  constexpr float kHalfTurn = std::numbers::pi_v<float>;
  const float along = std::abs(x), across = std::abs(y);
  const float most = std::max(along, across);
  if (!(most > 0.0F)) return 0.0F;
  const float a = std::min(along, across) / most, s = a * a;
  float angle = ((-0.0464964749F * s + 0.15931422F) * s - 0.327622764F) * s * a + a;
  if (across > along) angle = 0.5F * kHalfTurn - angle;
  if (x < 0.0F) angle = kHalfTurn - angle;
  return y < 0.0F ? -angle : angle;
}

/// The key of a voxel so many columns away, at the same height.
std::uint64_t moved(std::uint64_t key, std::int64_t x, std::int64_t y) {
  constexpr std::uint64_t kMask = (1U << 21U) - 1;
  const auto part = [&](unsigned shift, std::int64_t by) {
    return (((key >> shift) + static_cast<std::uint64_t>(by)) & kMask) << shift;
  };
  return part(42, x) | part(21, y) | (key & kMask);
}

/// The points of a map by square tiles of the plan.
Groups in_tiles(PointsView map) {
  const Bounds3 bounds = bounds_of(map);
  const std::array first{voxel_along(bounds.min.x()), voxel_along(bounds.min.y())};
  const std::array last{voxel_along(bounds.max.x()), voxel_along(bounds.max.y())};
  std::int64_t side = kTile;
  const auto tiles = [&](std::size_t axis) {
    return static_cast<std::size_t>((last[axis] - first[axis]) / side) + 1;
  };
  while (std::max(tiles(0), tiles(1)) > kMostTiles) side *= 2;
  const std::size_t columns = tiles(0);
  return grouped(
      map.size(), columns * tiles(1), [](std::size_t k) { return static_cast<std::uint32_t>(k); },
      [&](std::uint32_t k) {
        const auto x = static_cast<std::size_t>((voxel_along(map[k].x()) - first[0]) / side);
        const auto y = static_cast<std::size_t>((voxel_along(map[k].y()) - first[1]) / side);
        return y * columns + x;
      });
}

/// Sums of the points in a voxel, in whole micrometres from its corner: they are the same in any
/// order.
struct Sums {
  using Whole = Eigen::Matrix<std::int64_t, 3, 1>;
  std::int64_t count = 0;
  Whole sum = Whole::Zero();
  Eigen::Matrix<std::int64_t, 3, 3> squares = Eigen::Matrix<std::int64_t, 3, 3>::Zero();

  void add(const Whole& p) {
    ++count;
    sum += p;
    squares.noalias() += p * p.transpose();
  }
  /// @param shift  from the corner of these to that of the others
  void add(const Sums& others, const Whole& shift) {
    count += others.count;
    sum += others.sum + others.count * shift;
    squares += others.squares + others.sum * shift.transpose() + shift * others.sum.transpose() +
               others.count * (shift * shift.transpose());
  }
};

constexpr double kUnit = 1e-6;  // [m]

struct Plane {
  Point middle;  // from the voxel's corner [m]
  Point normal;
};
/// None if the points are too few or not flat.
std::optional<Plane> plane_of(const Sums& sums) {
  constexpr std::int64_t kFewest = 6;
  constexpr double kFlat = 0.1;  // of the eigenvalues
  if (sums.count < kFewest) return std::nullopt;
  const auto points = static_cast<double>(sums.count);
  const Point mean = kUnit * sums.sum.cast<double>() / points;
  const Eigen::Matrix3d covariance =
      kUnit * kUnit * sums.squares.cast<double>() / points - mean * mean.transpose();
  Eigen::SelfAdjointEigenSolver<Eigen::Matrix3d> axes;
  axes.computeDirect(covariance);
  if (!(axes.eigenvalues()[0] < kFlat * axes.eigenvalues()[1])) return std::nullopt;
  return Plane{mean, axes.eigenvectors().col(0)};
}

/// The points in a voxel.
struct Voxel {
  std::uint64_t key = 0;
  Point corner;         // map frame [m]
  std::uint32_t point;  // one of them, whatever their order is
  Sums sums;
};

using Keyed = std::pair<std::uint64_t, std::uint32_t>;

Voxel voxel_with(PointsView map, std::span<const Keyed> points) {
  const Point& some = map[points.front().second];
  Voxel voxel{.key = points.front().first,
              .corner = kEdge * Point((some / kEdge).array().floor()),
              .point = 0,
              .sums = {}};
  std::pair<std::uint64_t, std::uint32_t> least{~std::uint64_t{0}, 0};
  for (const auto& [key, k] : points) {
    const Sums::Whole p = ((map[k] - voxel.corner) / kUnit).array().round().cast<std::int64_t>();
    voxel.sums.add(p);
    least = std::min(least, {hash(5, p.x(), p.y(), p.z()), k});
  }
  voxel.point = least.second;
  return voxel;
}

/// All voxels of a map, ascending by key.
std::vector<Voxel> voxels_of(PointsView map) {
  const Groups tiles = in_tiles(map);
  std::vector<std::vector<Voxel>> of_tile(tiles.begin.size() - 1);
  tbb::parallel_for(std::size_t{0}, of_tile.size(), [&](std::size_t tile) {
    std::vector<Keyed> keyed;
    for (const std::uint32_t k : tiles[tile]) keyed.emplace_back(voxel_of(map[k]), k);
    std::ranges::sort(keyed);
    for (std::size_t from = 0; from < keyed.size();) {
      std::size_t end = from;
      while (end < keyed.size() && keyed[end].first == keyed[from].first) ++end;
      of_tile[tile].push_back(voxel_with(map, std::span(keyed).subspan(from, end - from)));
      from = end;
    }
  });
  std::vector<Voxel> voxels;
  for (auto& some : of_tile) {
    voxels.insert(voxels.end(), some.begin(), some.end());
    some = {};
  }
  std::ranges::sort(voxels, {}, &Voxel::key);
  return voxels;
}

/// The voxel's points and those of the voxels around it.
Sums around(const std::vector<Voxel>& voxels, const Voxel& voxel) {
  const auto edge = static_cast<std::int64_t>(std::llround(kEdge / kUnit));
  Sums sums;
  for (std::int64_t x = -1; x <= 1; ++x) {
    for (std::int64_t y = -1; y <= 1; ++y) {
      const std::uint64_t column = moved(voxel.key, x, y);
      auto at = std::ranges::lower_bound(voxels, column == 0 ? 0 : column - 1, {}, &Voxel::key);
      for (; at != voxels.end() && at->key <= column + 1; ++at) {
        const auto z = static_cast<std::int64_t>(at->key - column);
        sums.add(at->sums, edge * Sums::Whole(x, y, z));
      }
    }
  }
  return sums;
}

}  // namespace

struct Surfaces::Parts {
  PointCloud middles;
  std::vector<Disc> discs;
  PointCloud cube_middles;
  std::vector<Cube> cubes;
  float widest = 0.0F;
};

Surfaces::Surfaces(PointsView map) : Surfaces(parts_of(map)) {}

Surfaces::Surfaces(Parts parts)
    : middles_(std::move(parts.middles)),
      discs_(std::move(parts.discs)),
      cube_middles_(std::move(parts.cube_middles)),
      cubes_(std::move(parts.cubes)),
      widest_(parts.widest),
      plan_(cube_middles_, cube_middles_.size(),
            [](std::size_t k) { return static_cast<std::uint32_t>(k); }) {}

Surfaces::Parts Surfaces::parts_of(PointsView map) {
  if (map.empty()) return {};
  constexpr std::int64_t kEnough = 30;
  constexpr float kDiscRadius = 0.3F, kPointRadius = 0.2F;
  const std::vector<Voxel> voxels = voxels_of(map);
  std::vector<std::pair<std::uint64_t, std::uint32_t>> order;  // by cube
  for (std::uint32_t k = 0; k < voxels.size(); ++k) order.emplace_back(cube_of(voxels[k].key), k);
  std::ranges::sort(order);
  Parts all{PointCloud(voxels.size()), std::vector<Disc>(voxels.size()), {}, {}};
  tbb::parallel_for(std::size_t{0}, voxels.size(), [&](std::size_t k) {
    const Voxel& voxel = voxels[order[k].second];
    const Point own = kUnit * voxel.sums.sum.cast<double>() / static_cast<double>(voxel.sums.count);
    std::optional<Plane> plane;
    if (voxel.sums.count < kEnough) plane = plane_of(around(voxels, voxel));
    if (!plane) plane = plane_of(voxel.sums);
    if (!plane) {
      all.middles[k] = map[voxel.point];
      all.discs[k] = {Eigen::Vector3f::Zero(), kPointRadius};
      return;
    }
    const double off = plane->normal.dot(own - plane->middle);
    all.middles[k] = voxel.corner + own - off * plane->normal;
    all.discs[k] = {plane->normal.cast<float>(), kDiscRadius};
  });
  for (std::uint32_t begin = 0, end = 0; begin < order.size(); begin = end) {
    Bounds3 bounds;
    for (; end < order.size() && order[end].first == order[begin].first; ++end) {
      bounds.extend(all.middles[end]);
    }
    all.cube_middles.emplace_back(0.5 * (bounds.min + bounds.max));
    const double radius = 0.5 * (bounds.max - bounds.min).norm() + double{kDiscRadius} + 0.01;
    all.cubes.push_back({begin, end, static_cast<float>(radius)});
    all.widest = std::max(all.widest, all.cubes.back().radius);
  }
  return all;
}

namespace {

constexpr int kRings = 20, kColumns = 360;
constexpr double kNone = std::numeric_limits<double>::infinity();
// Discs overlap. The nearest one along the ray would be off towards the sensor.
constexpr double kSameSurface = 0.3;  // [m]

/// The directions of a scan's rays, and how far each has been followed.
class Raster {
 public:
  explicit Raster(const Rays& rays)
      : lowest_(static_cast<float>(rays.lowest * kDegree)), nearest_(kRings * kColumns, kNone) {
    const double step = std::max((rays.highest - rays.lowest) * kDegree / (kRings - 1), 1e-6);
    rings_a_radian_ = static_cast<float>(1.0 / step);
    for (std::size_t r = 0; r < kRings; ++r) {
      const double elevation = rays.lowest * kDegree + static_cast<double>(r) * step;
      ring_[r] = {std::cos(elevation), std::sin(elevation)};
    }
    for (std::size_t c = 0; c < kColumns; ++c) {
      const double azimuth = static_cast<double>(c) * kColumnStep;
      column_[c] = {std::cos(azimuth), std::sin(azimuth)};
    }
  }

  [[nodiscard]] Point direction(std::size_t ray) const {
    const auto& [cosine, sine] = ring_[ray / kColumns];
    const auto& [x, y] = column_[ray % kColumns];
    return {cosine * x, cosine * y, sine};
  }
  [[nodiscard]] double nearest(std::size_t ray) const { return nearest_[ray]; }
  void meets(std::size_t ray, double range) { nearest_[ray] = std::min(nearest_[ray], range); }

  /// Calls use(ray) for the rays that may meet a ball, and some others near it, until `use` returns
  /// true.
  /// @param to  its middle, from the sensor, farther away than the radius
  /// @return    whether `use` returned true
  template <class Use>
  bool any_near(const Eigen::Vector3f& to, float radius, const Use& use) const {
    const float plan = to.head<2>().norm();
    const float high = no_less_than_asin(radius / to.norm()) + kAtanError;
    const float elevation = about_atan2(to.z(), plan) - lowest_;
    const int first =
        std::max(0, static_cast<int>(std::ceil((elevation - high) * rings_a_radian_)));
    const int last =
        std::min(kRings - 1, static_cast<int>(std::floor((elevation + high) * rings_a_radian_)));
    if (first > last) return false;
    const float azimuth = about_atan2(to.y(), to.x());
    const float wide = plan > radius ? no_less_than_asin(radius / plan) + kAtanError : kAllAround;
    const int from = static_cast<int>(std::ceil((azimuth - wide) * kColumnsARadian));
    const int end = std::min(from + kColumns - 1,
                             static_cast<int>(std::floor((azimuth + wide) * kColumnsARadian)));
    for (int c = from; c <= end; ++c) {
      const int around = (c + 2 * kColumns) % kColumns;
      for (int r = first; r <= last; ++r) {
        if (use(static_cast<std::size_t>(r * kColumns + around))) return true;
      }
    }
    return false;
  }

 private:
  static constexpr double kColumnStep = 2.0 * std::numbers::pi / kColumns;
  static constexpr float kAllAround = 3.5F;  // half a turn and more [rad]
  static constexpr auto kColumnsARadian = static_cast<float>(1.0 / kColumnStep);

  float lowest_, rings_a_radian_ = 0.0F;
  std::array<std::pair<double, double>, kRings> ring_;      // cosine and sine
  std::array<std::pair<double, double>, kColumns> column_;  // the same
  std::vector<double> nearest_;                             // surface along each ray [m]
};

}  // namespace

PointCloud Surfaces::scan(const Point& sensor, const Rays& rays) const {
  constexpr double kNearest = 1.0, kGrazing = 0.02;  // [m], sine of the angle to the surface
  constexpr double kBeside = 0.01;                   // the sensor is in the ball, or nearly [m]
  const double range = std::min(rays.max_range, kFarthestReturn);
  Raster raster(rays);
  struct Near {
    double from;  // the sensor [m]
    std::uint32_t cube;
  };
  std::vector<Near> order;
  const Eigen::Vector2d side = Eigen::Vector2d::Constant(range + double{widest_});
  for (const std::uint32_t k : plan_.near(sensor.head<2>() - side, sensor.head<2>() + side)) {
    const double from = (cube_middles_[k] - sensor).norm() - double{cubes_[k].radius};
    if (from <= range) order.push_back({from, k});
  }
  std::ranges::sort(order, {}, [](const Near& near) { return std::pair(near.from, near.cube); });
  struct Meeting {
    double range, off;  // off: squared distance from the disc's middle
    std::size_t ray;
    std::uint32_t disc;
  };
  std::vector<Meeting> meetings;
  const auto meet = [&](std::uint32_t k) {
    const Point to = middles_[k] - sensor;
    const Disc& disc = discs_[k];
    const double away = to.norm(), radius = disc.radius;
    if (away > range || away < radius) return;
    const Point normal = disc.normal.cast<double>();
    const bool flat = disc.normal != Eigen::Vector3f::Zero();
    const double height = normal.dot(to);
    raster.any_near(to.cast<float>(), disc.radius, [&](std::size_t ray) {
      if (raster.nearest(ray) + kSameSurface < away - radius) return false;
      const Point direction = raster.direction(ray);
      double at = away;
      if (flat) {
        const double towards = normal.dot(direction);
        if (std::abs(towards) < kGrazing) return false;
        at = height / towards;
      }
      if (!(at >= kNearest && at <= range)) return false;
      const double off = (at * direction - to).squaredNorm();
      if (off > radius * radius) return false;
      raster.meets(ray, at);
      meetings.push_back({at, off, ray, k});
      return false;
    });
  };
  for (const auto& [from, k] : order) {
    // What lies behind surfaces is met by no ray.
    const auto open = [&, away = from](std::size_t ray) {
      return raster.nearest(ray) + kSameSurface >= away;
    };
    if (from > kBeside &&
        !raster.any_near((cube_middles_[k] - sensor).cast<float>(), cubes_[k].radius, open)) {
      continue;
    }
    for (std::uint32_t disc = cubes_[k].begin; disc < cubes_[k].end; ++disc) meet(disc);
  }
  struct Hit {
    double off = kNone, range = 0.0;
    std::uint32_t disc = 0;
  };
  std::vector<Hit> hits(std::size_t{kRings} * kColumns);
  for (const Meeting& m : meetings) {
    if (m.range > raster.nearest(m.ray) + kSameSurface) continue;
    // Equal ones: the order of discs is the same in every map, that of cubes is not.
    const Hit& hit = hits[m.ray];
    if (std::pair(m.off, m.disc) < std::pair(hit.off, hit.disc)) {
      hits[m.ray] = {m.off, m.range, m.disc};
    }
  }
  PointCloud scan;
  for (std::size_t ray = 0; ray < hits.size(); ++ray) {
    const Hit& hit = hits[ray];
    if (!std::isfinite(hit.off)) continue;
    scan.push_back(discs_[hit.disc].normal != Eigen::Vector3f::Zero()
                       ? Point(sensor + hit.range * raster.direction(ray))
                       : middles_[hit.disc]);
  }
  return scan;
}

}  // namespace vantage
