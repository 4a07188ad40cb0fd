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

double no_less_than_asin(double x) { return x < 0.5 ? 1.05 * x : std::asin(x); }

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
};

Surfaces::Surfaces(PointsView map)
    : Surfaces([&] {
        if (map.empty()) return Parts{};
        constexpr std::int64_t kEnough = 30;
        constexpr float kDiscRadius = 0.3F, kPointRadius = 0.2F;
        const std::vector<Voxel> voxels = voxels_of(map);
        Parts all{PointCloud(voxels.size()), std::vector<Disc>(voxels.size())};
        tbb::parallel_for(std::size_t{0}, voxels.size(), [&](std::size_t k) {
          const Voxel& voxel = voxels[k];
          const Point own =
              kUnit * voxel.sums.sum.cast<double>() / static_cast<double>(voxel.sums.count);
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
        return all;
      }()) {}

Surfaces::Surfaces(Parts parts)
    : middles_(std::move(parts.middles)),
      discs_(std::move(parts.discs)),
      plan_(middles_, middles_.size(),
            [](std::size_t k) { return static_cast<std::uint32_t>(k); }) {}

PointCloud Surfaces::scan(const Point& sensor, const Rays& rays) const {
  constexpr int kRings = 20, kColumns = 360;
  constexpr double kNearest = 1.0, kGrazing = 0.02;  // [m], sine of the angle to the surface
  constexpr double kColumnStep = 2.0 * std::numbers::pi / kColumns;
  const double lowest = rays.lowest * kDegree, highest = rays.highest * kDegree;
  const double ring_step = std::max((highest - lowest) / (kRings - 1), 1e-6);
  const double range = std::min(rays.max_range, kFarthestReturn);
  std::array<std::pair<double, double>, kRings> ring;  // cosine and sine
  for (int r = 0; r < kRings; ++r) {
    ring[static_cast<std::size_t>(r)] = {std::cos(lowest + r * ring_step),
                                         std::sin(lowest + r * ring_step)};
  }
  std::array<std::pair<double, double>, kColumns> column;
  for (int c = 0; c < kColumns; ++c) {
    column[static_cast<std::size_t>(c)] = {std::cos(c * kColumnStep), std::sin(c * kColumnStep)};
  }
  constexpr double kNone = std::numeric_limits<double>::infinity();
  struct Meeting {
    double range, off;  // off: squared distance from the disc's middle
    std::uint32_t ray, disc;
  };
  std::vector<Meeting> meetings;
  std::vector<double> nearest(std::size_t{kRings} * kColumns, kNone);
  const Eigen::Vector2d side = Eigen::Vector2d::Constant(range);
  plan_.for_each_near(sensor.head<2>() - side, sensor.head<2>() + side, [&](std::uint32_t k) {
    const Point to = middles_[k] - sensor;
    const Disc& disc = discs_[k];
    const double radius = disc.radius, away = to.norm(), plan = to.head<2>().norm();
    if (away > range || away < radius) return;
    const double high = no_less_than_asin(radius / away);
    const double elevation = std::atan2(static_cast<float>(to.z()), static_cast<float>(plan));
    const int first =
        std::max(0, static_cast<int>(std::ceil((elevation - high - lowest) / ring_step)));
    const int last =
        std::min(kRings - 1, static_cast<int>(std::floor((elevation + high - lowest) / ring_step)));
    if (first > last) return;
    const double azimuth = std::atan2(static_cast<float>(to.y()), static_cast<float>(to.x()));
    const double wide = plan > radius ? no_less_than_asin(radius / plan) : std::numbers::pi;
    const int from = static_cast<int>(std::ceil((azimuth - wide) / kColumnStep));
    const int end =
        std::min(from + kColumns - 1, static_cast<int>(std::floor((azimuth + wide) / kColumnStep)));
    const Point normal = disc.normal.cast<double>();
    const bool flat = disc.normal != Eigen::Vector3f::Zero();
    const double height = normal.dot(to);
    for (int c = from; c <= end; ++c) {
      const auto around = static_cast<std::uint32_t>((c + 2 * kColumns) % kColumns);
      for (int r = first; r <= last; ++r) {
        const auto& [cosine, sine] = ring[static_cast<std::size_t>(r)];
        const Point ray(cosine * column[around].first, cosine * column[around].second, sine);
        double at = away;
        if (flat) {
          const double towards = normal.dot(ray);
          if (std::abs(towards) < kGrazing) continue;
          at = height / towards;
        }
        if (!(at >= kNearest && at <= range)) continue;
        const double off = (at * ray - to).squaredNorm();
        if (off > radius * radius) continue;
        const auto number = static_cast<std::uint32_t>(r * kColumns) + around;
        nearest[number] = std::min(nearest[number], at);
        meetings.push_back({at, off, number, k});
      }
    }
  });
  // Discs overlap. The nearest one along the ray would be off towards the sensor.
  constexpr double kSameSurface = 0.3;  // [m]
  struct Hit {
    double off = kNone, range = 0.0;
    std::uint32_t disc = 0;
  };
  std::vector<Hit> hits(nearest.size());
  for (const Meeting& m : meetings) {
    if (m.range > nearest[m.ray] + kSameSurface) continue;
    if (m.off < hits[m.ray].off) hits[m.ray] = {m.off, m.range, m.disc};
  }
  PointCloud scan;
  for (std::size_t k = 0; k < hits.size(); ++k) {
    if (!std::isfinite(hits[k].off)) continue;
    const Disc& disc = discs_[hits[k].disc];
    const auto& [cosine, sine] = ring[k / kColumns];
    const auto& [x, y] = column[k % kColumns];
    scan.push_back(disc.normal != Eigen::Vector3f::Zero()
                       ? Point(sensor + hits[k].range * Point(cosine * x, cosine * y, sine))
                       : middles_[hits[k].disc]);
  }
  return scan;
}

}  // namespace vantage
