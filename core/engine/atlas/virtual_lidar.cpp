#include "atlas/virtual_lidar.hpp"

#include <Eigen/Eigenvalues>
#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <numbers>
#include <vector>

#include "vantage/kit/hash.hpp"

namespace vantage {
namespace {

constexpr int kRings = 20, kColumns = 720;
constexpr double kLowestRing = -23.0, kRingStep = 2.0, kColumnStep = 360.0 / kColumns;  // [deg]
constexpr double kDegree = std::numbers::pi / 180.0;
constexpr double kNearestReturn = 1.0;  // [m]

/// Twice the median distance of a point to its nearest neighbour: discs of this radius around the
/// points of a surface leave no holes.
/// @param around  some of the map's points, ascending
double reach_in(PointsView map, const PlanIndex& plan, const IndexList& around) {
  constexpr std::size_t kSamples = 200;
  constexpr double kWithin = 1.0, kLeast = 0.1, kMost = 0.8;  // [m]
  std::vector<double> nearest;
  const std::size_t samples = std::min(kSamples, around.size());
  for (std::size_t k = 0; k < samples; ++k) {
    const Point& p = map[around[k * around.size() / samples]];
    const Eigen::Vector2d at = p.head<2>(), side = Eigen::Vector2d::Constant(kWithin);
    double least = kWithin * kWithin;
    for (const std::uint32_t i : plan.near(at - side, at + side)) {
      const double away = (map[i] - p).squaredNorm();
      if (away > 0.0) least = std::min(least, away);
    }
    nearest.push_back(std::sqrt(least));
  }
  if (nearest.empty()) return kLeast;
  const auto middle = nearest.begin() + static_cast<std::ptrdiff_t>(nearest.size() / 2);
  std::nth_element(nearest.begin(), middle, nearest.end());
  return std::clamp(2.0 * *middle, kLeast, kMost);
}

/// To 0.1 degrees between the lowest and the highest ring.
double small_arc_tangent(double x) { return x * (1.0 - x * x * (1.0 / 3.0 - x * x / 5.0)); }

/// In [0, 1).
double uniform(std::uint64_t bits) { return static_cast<double>(bits >> 11U) * 0x1p-53; }

/// Nearly normal, of unit variance: the sum of four uniform numbers.
double nearly_normal(std::uint64_t seed) {
  double sum = -2.0;
  for (std::uint64_t i = 0; i < 4; ++i) sum += uniform(hash(seed, i));
  return sum * std::numbers::sqrt3;
}

}  // namespace

VirtualLidar::VirtualLidar(PointsView map, double max_range)
    : map_(map),
      plan_(map, map.size(), [](std::size_t k) { return static_cast<std::uint32_t>(k); }),
      range_(std::min(max_range, kFarthestReturn)) {}

namespace {

/// A map point as the sensor sees it, in units of rings and columns.
struct Candidate {
  double range, elevation, azimuth;
  int first_ring, last_ring, first_column, last_column;
  std::uint32_t point;
};

/// Where a ray meets the plane through the points around one that it passes; that point itself if
/// they are not a plane, or if the ray nearly grazes it. A scan shares the surface with the map,
/// but not the noise of the map's points, nor the noise that makes a point the first one to be hit.
/// @param ray  unit vector
Point on_surface(PointsView map, const PlanIndex& plan, const Point& sensor, const Point& ray,
                 const Point& passed, double radius) {
  constexpr double kFewest = 8.0, kFlat = 0.1;  // of the eigenvalues
  constexpr double kGrazing = 0.02, kAlong = 0.3;
  const Eigen::Vector2d side = Eigen::Vector2d::Constant(radius);
  // Whole micrometres: their sums are the same in any order.
  constexpr double kUnit = 1e-6;
  using Whole = Eigen::Matrix<std::int64_t, 3, 1>;
  std::int64_t count = 0;
  Whole sum = Whole::Zero();
  Eigen::Matrix<std::int64_t, 3, 3> squares = Eigen::Matrix<std::int64_t, 3, 3>::Zero();
  plan.for_each_near(passed.head<2>() - side, passed.head<2>() + side, [&](std::uint32_t k) {
    const Point from = map[k] - passed;
    if (from.squaredNorm() > radius * radius) return;
    const Whole whole = (from / kUnit).array().round().cast<std::int64_t>();
    ++count;
    sum += whole;
    squares.noalias() += whole * whole.transpose();
  });
  const auto points = static_cast<double>(count);
  if (points < kFewest) return passed;
  const Point mean = kUnit * sum.cast<double>() / points;
  const Eigen::Matrix3d covariance =
      kUnit * kUnit * squares.cast<double>() / points - mean * mean.transpose();
  Eigen::SelfAdjointEigenSolver<Eigen::Matrix3d> axes;
  axes.computeDirect(covariance);
  if (!(axes.eigenvalues()[0] < kFlat * axes.eigenvalues()[1])) return passed;
  const Point normal = axes.eigenvectors().col(0);
  const double towards = normal.dot(ray), range = (passed - sensor).norm();
  if (std::abs(towards) < kGrazing) return passed + normal.dot(mean) * normal;
  const double at = normal.dot(passed + mean - sensor) / towards;
  if (std::abs(at - range) > kAlong * range) return passed + normal.dot(mean) * normal;
  return sensor + at * ray;
}

/// The direction of a ray.
Point direction_of(std::size_t ray) {
  const double elevation =
      (kLowestRing + kRingStep * static_cast<double>(ray / kColumns)) * kDegree;
  const double azimuth = (kColumnStep * static_cast<double>(ray % kColumns) - 180.0) * kDegree;
  return {std::cos(elevation) * std::cos(azimuth), std::cos(elevation) * std::sin(azimuth),
          std::sin(elevation)};
}

/// Calls use(ray, up, aside) for every ray that passes the point closely enough, with the ray's
/// distance from it in rings and columns.
template <class Use>
void for_each_ray(const Candidate& c, const Use& use) {
  for (int around = c.first_column; around <= c.last_column; ++around) {
    const int column = (around + kColumns) % kColumns;
    for (int ring = c.first_ring; ring <= c.last_ring; ++ring) {
      use(static_cast<std::size_t>(ring * kColumns + column), ring - c.elevation,
          around - c.azimuth);
    }
  }
}

}  // namespace

PointCloud VirtualLidar::hits(const Point& sensor, Aim aim) const {
  const Eigen::Vector2d side = Eigen::Vector2d::Constant(range_);
  constexpr double kPerDegree = 1.0 / kDegree;
  const double lowest = std::tan((kLowestRing - kRingStep) * kDegree);
  const double highest = std::tan((kLowestRing + kRings * kRingStep) * kDegree);
  IndexList within = plan_.near(sensor.head<2>() - side, sensor.head<2>() + side);
  std::erase_if(within, [&](std::uint32_t k) {
    return (map_[k] - sensor).head<2>().squaredNorm() > range_ * range_;
  });
  const double reach = reach_in(map_, plan_, within);
  constexpr std::size_t kRays = std::size_t{kRings} * kColumns;
  constexpr double kNone = std::numeric_limits<double>::infinity();
  std::vector<double> nearest(kRays, kNone);
  std::vector<std::uint32_t> point(kRays, 0);
  std::vector<Candidate> candidates;  // for a second look
  for (const std::uint32_t k : within) {
    const Point to = map_[k] - sensor;
    const double plan = to.head<2>().norm();
    // Most points are too high or too low, or between two rings.
    if (to.z() + reach < lowest * plan || to.z() - reach > highest * plan) continue;
    const double range = to.norm();
    if (plan < kNearestReturn || range > range_) continue;
    const double wide = reach / range * kPerDegree;
    const double elevation = small_arc_tangent(to.z() / plan) * kPerDegree - kLowestRing;
    const int first = std::max(0, static_cast<int>(std::ceil((elevation - wide) / kRingStep)));
    const int last =
        std::min(kRings - 1, static_cast<int>(std::floor((elevation + wide) / kRingStep)));
    if (first > last) continue;
    const double azimuth =
        (std::atan2(static_cast<float>(to.y()), static_cast<float>(to.x())) * kPerDegree + 180.0) /
        kColumnStep;
    const auto from = static_cast<int>(std::ceil(azimuth - wide / kColumnStep));
    const auto end =
        std::min(from + kColumns - 1, static_cast<int>(std::floor(azimuth + wide / kColumnStep)));
    const Candidate c{range, elevation / kRingStep, azimuth, first, last, from, end, k};
    for_each_ray(c, [&](std::size_t ray, double, double) {
      if (range >= nearest[ray]) return;
      nearest[ray] = range;
      point[ray] = k;
    });
    if (aim == Aim::middle) candidates.push_back(c);
  }
  constexpr double kSameSurface = 0.5;  // [m]
  std::vector<double> least(aim == Aim::middle ? kRays : 0, kNone);
  for (const Candidate& c : candidates) {
    for_each_ray(c, [&](std::size_t ray, double up, double aside) {
      if (c.range > nearest[ray] + kSameSurface) return;
      const double offset =
          up * up * kRingStep * kRingStep + aside * aside * kColumnStep * kColumnStep;
      if (offset >= least[ray]) return;
      least[ray] = offset;
      point[ray] = c.point;
    });
  }
  PointCloud hits;
  const double around = std::clamp(3.0 * reach, 0.3, 0.8);
  // The surface is smooth: half of the rays tell as much.
  const std::size_t step = aim == Aim::middle ? 2 : 1;
  for (std::size_t ray = 0; ray < kRays; ray += step) {
    if (!std::isfinite(nearest[ray])) continue;
    const Point& passed = map_[point[ray]];
    hits.push_back(aim == Aim::nearest
                       ? passed
                       : on_surface(map_, plan_, sensor, direction_of(ray), passed, around));
  }
  return hits;
}

PointCloud virtual_scan(PointsView hits, const Pose& T_map_scan, std::uint64_t seed) {
  constexpr double kNoise = 0.02, kSector = 60.0 * kDegree, kClutter = 1.0 / 30.0;
  enum Use : std::uint64_t { sector, clutter, noise };
  const Pose T_scan_map = T_map_scan.inverse();
  const Eigen::Matrix3d R = T_scan_map.rotation.toRotationMatrix();
  const double covered = 2.0 * std::numbers::pi * uniform(hash(seed, sector));
  PointCloud scan;
  scan.reserve(hits.size());
  for (std::size_t k = 0; k < hits.size(); ++k) {
    const Point p = R * hits[k] + T_scan_map.translation;
    const double beside =
        std::remainder(std::atan2(p.y(), p.x()) - covered, 2.0 * std::numbers::pi);
    if (std::abs(beside) < kSector / 2.0) continue;
    const double range = p.norm(), lot = uniform(hash(seed, clutter, k));
    // What is left of the lot is where the clutter is.
    const double seen =
        lot < kClutter ? std::lerp(kNearestReturn, std::max(kNearestReturn, range), lot / kClutter)
                       : range + kNoise * nearly_normal(hash(seed, noise, k));
    scan.push_back(p * (seen / range));
  }
  return scan;
}

}  // namespace vantage
