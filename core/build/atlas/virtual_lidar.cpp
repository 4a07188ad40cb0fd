#include "build/atlas/virtual_lidar.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <memory>
#include <numbers>
#include <vector>

#include "build/blocks.hpp"
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

PointCloud VirtualLidar::hits(const Point& sensor) const {
  struct Hit {
    double range = std::numeric_limits<double>::infinity();
    std::uint32_t point = 0;
  };
  std::vector<Hit> rays(std::size_t{kRings} * kColumns);
  const Eigen::Vector2d side = Eigen::Vector2d::Constant(range_);
  constexpr double kPerDegree = 1.0 / kDegree;
  const double lowest = std::tan((kLowestRing - kRingStep) * kDegree);
  const double highest = std::tan((kLowestRing + kRings * kRingStep) * kDegree);
  IndexList within = plan_.near(sensor.head<2>() - side, sensor.head<2>() + side);
  std::erase_if(within, [&](std::uint32_t k) {
    return (map_[k] - sensor).head<2>().squaredNorm() > range_ * range_;
  });
  const double reach = reach_in(map_, plan_, within);
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
    for (int around = from; around <= end; ++around) {
      const int column = (around + kColumns) % kColumns;
      for (int ring = first; ring <= last; ++ring) {
        Hit& hit =
            rays[static_cast<std::size_t>(ring) * kColumns + static_cast<std::size_t>(column)];
        if (range < hit.range) hit = {range, k};
      }
    }
  }
  PointCloud hits;
  for (const Hit& hit : rays) {
    if (std::isfinite(hit.range)) hits.push_back(map_[hit.point]);
  }
  return hits;
}

HitsAt hits_in(const MapParts& map, double max_range) {
  if (const Result<PointsView> all = map.in_memory()) {
    const auto lidar = std::make_shared<const VirtualLidar>(*all, max_range);
    return [lidar](const Point& sensor) -> Result<PointCloud> { return lidar->hits(sensor); };
  }
  return [&map, max_range](const Point& sensor) -> Result<PointCloud> {
    const Bounds2 here{sensor.head<2>(), sensor.head<2>()};
    VANTAGE_TRY(const MapPart around, map.read(with_margin(here, reach_of_hits(max_range))));
    return VirtualLidar(around.points(), max_range).hits(sensor);
  };
}

double reach_of_hits(double max_range) noexcept {
  constexpr double kNeighbours = 1.0;  // of the points that are hit [m]
  return std::min(max_range, VirtualLidar::kFarthestReturn) + kNeighbours;
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
