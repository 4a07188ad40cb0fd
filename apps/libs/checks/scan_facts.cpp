#include "checks/scan_facts.hpp"

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <map>
#include <numbers>
#include <random>
#include <utility>

#include "checks/median.hpp"
#include "checks/sensor_place.hpp"

namespace vantage::checks {
namespace {

double eccentricity_of(PointsView scan) {
  Point middle;
  for (Eigen::Index axis = 0; axis < 3; ++axis) {
    std::vector<double> values;
    for (const Point& p : scan) values.push_back(p[axis]);
    middle[axis] = median_of(std::move(values));
  }
  std::vector<double> distances;
  for (const Point& p : scan) distances.push_back((p - middle).norm());
  const double spread = median_of(std::move(distances));
  return spread > 0.0 ? middle.norm() / spread : 0.0;
}

/// The lowest points of the square metres around the sensor.
PointCloud lowest_around(PointsView scan, double sign) {
  constexpr double kNearest = 1.0, kFarthest = 20.0;  // [m]
  std::map<std::pair<int, int>, Point> lowest;
  for (const Point& p : scan) {
    const double range = p.head<2>().norm();
    if (!(range > kNearest && range < kFarthest)) continue;
    const Point q(p.x(), p.y(), sign * p.z());
    const std::pair key(static_cast<int>(std::floor(p.x())), static_cast<int>(std::floor(p.y())));
    const auto [cell, fresh] = lowest.try_emplace(key, q);
    if (!fresh && q.z() < cell->second.z()) cell->second = q;
  }
  PointCloud points;
  for (const auto& [key, p] : lowest) points.push_back(p);
  return points;
}

/// The value that a share of the others is below; 0 without values.
double value_at(const std::vector<float>& ascending, double share) {
  if (ascending.empty()) return 0.0;
  const auto last = static_cast<double>(ascending.size() - 1);
  return ascending[static_cast<std::size_t>(std::clamp(share, 0.0, 1.0) * last)];
}

}  // namespace

std::optional<GroundPlane> find_ground(PointsView scan, bool above) {
  constexpr std::size_t kFewest = 20;
  // Least square metres of a plane: on two recordings and five simulated drives, ground had 170 or
  // more, and other planes 42 at most.
  constexpr double kLeast = 80.0;
  constexpr int kTries = 300;
  constexpr double kNear = 0.1;                        // [m]
  constexpr double kUpright = std::numbers::pi / 6.0;  // [rad]
  const PointCloud lowest = lowest_around(scan, above ? -1.0 : 1.0);
  if (lowest.size() < kFewest) return std::nullopt;
  std::mt19937 random(1);
  const auto any = [&]() -> const Point& { return lowest[random() % lowest.size()]; };
  std::optional<GroundPlane> best;
  for (int k = 0; k < kTries; ++k) {
    const Point &a = any(), &b = any(), &c = any();
    Eigen::Vector3d normal = (b - a).cross(c - a);
    if (!(normal.norm() > 1.0)) continue;  // nearly on a line
    normal.normalize();
    if (normal.z() < 0.0) normal = -normal;
    const double tilt = std::acos(std::min(1.0, normal.z()));
    const double distance = -normal.dot(a);
    if (tilt > kUpright || distance <= 0.0) continue;
    std::size_t near = 0, below = 0;
    for (const Point& p : lowest) {
      if (std::abs(normal.dot(p) + distance) >= kNear) continue;
      ++near;
      below += p.z() < 0.0 ? 1 : 0;
    }
    if (2 * below < near) continue;  // a slope beside the sensor
    const double share = static_cast<double>(near) / static_cast<double>(lowest.size());
    if (!best || share > best->share) best = GroundPlane{distance, tilt, share};
  }
  if (best && best->share * static_cast<double>(lowest.size()) < kLeast) return std::nullopt;
  return best;
}

double ScanFacts::range_at(double share) const { return value_at(ranges, share); }

double ScanFacts::elevation_at(double share) const { return value_at(elevations, share); }

double ScanFacts::share_within(double least, double most) const {
  if (ranges.empty()) return 0.0;
  const auto from = std::lower_bound(ranges.begin(), ranges.end(), least);
  const auto to = std::upper_bound(from, ranges.end(), most);
  return static_cast<double>(to - from) / static_cast<double>(ranges.size());
}

void ScanSurvey::offer(const io::StampedScan& scan) {
  constexpr std::size_t kEvery = 10;
  if (offered_ < kAmong && offered_ % kEvery == 0) add(scan);
  ++offered_;
}

void ScanSurvey::add(const io::StampedScan& scan) {
  constexpr std::size_t kMostRanges = 20'000;
  constexpr double kNearest = 1.0;  // of elevations: nearer points may be the robot [m]
  sums_.timed = (sums_.scans == 0 || sums_.timed) && (scan.points.empty() || !scan.seconds.empty());
  ++sums_.scans;
  points_ += scan.points.size();
  dropped_ += scan.dropped + scan.no_returns;
  if (scan.points.empty()) {
    ++sums_.empty;
    return;
  }
  const std::size_t step = (scan.points.size() + kMostRanges - 1) / kMostRanges;
  for (std::size_t i = 0; i < scan.points.size(); i += step) {
    const Point& p = scan.points[i];
    sums_.ranges.push_back(static_cast<float>(p.norm()));
    if (sums_.ranges.back() > kNearest) {
      sums_.elevations.push_back(static_cast<float>(std::atan2(p.z(), p.head<2>().norm())));
    }
  }
  sizes_.push_back(static_cast<double>(scan.points.size()));
  eccentricities_.push_back(eccentricity_of(scan.points));
  place(scan);
  if (!scan.seconds.empty()) {
    const auto [first, last] = std::minmax_element(scan.seconds.begin(), scan.seconds.end());
    sweeps_.push_back(static_cast<double>(*last - *first));
  }
  if (const auto plane = find_ground(scan.points, false)) below_.push_back(*plane);
  if (const auto plane = find_ground(scan.points, true)) above_.push_back(*plane);
}

void ScanSurvey::place(const io::StampedScan& scan) {
  const SensorPlace found = find_sensor(scan.points);
  ++sums_.placed;
  if (!found.is_elsewhere()) return;
  ++sums_.elsewhere;
  sums_.farthest = std::max(sums_.farthest, found.at.norm());
}

ScanFacts ScanSurvey::facts() const {
  ScanFacts facts = sums_;
  facts.points = median_of(sizes_);
  facts.sweep = median_of(sweeps_);
  facts.eccentricity = median_of(eccentricities_);
  std::sort(facts.ranges.begin(), facts.ranges.end());
  std::sort(facts.elevations.begin(), facts.elevations.end());
  if (dropped_ > 0) {
    facts.dropped_share = static_cast<double>(dropped_) / static_cast<double>(dropped_ + points_);
  }
  const auto typical = [&](const std::vector<GroundPlane>& planes) -> std::optional<GroundPlane> {
    if (planes.empty() || 2 * planes.size() < facts.scans) return std::nullopt;
    const auto median = [&](double GroundPlane::*member) {
      std::vector<double> values;
      for (const GroundPlane& plane : planes) values.push_back(plane.*member);
      return median_of(std::move(values));
    };
    return GroundPlane{median(&GroundPlane::distance), median(&GroundPlane::tilt),
                       median(&GroundPlane::share)};
  };
  facts.below = typical(below_);
  facts.above = typical(above_);
  return facts;
}

}  // namespace vantage::checks
