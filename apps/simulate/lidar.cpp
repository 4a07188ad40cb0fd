#include "simulate/lidar.hpp"

#include <algorithm>
#include <cmath>
#include <numbers>

#include "simulate/random.hpp"

namespace vantage::simulation {
namespace {

constexpr double kDegree = std::numbers::pi / 180.0;
constexpr double kFarthestClutter = 15.0;  // [m]

}  // namespace

Lidar::Lidar(const LidarParams& params, std::uint64_t seed)
    : params_(params),
      seed_(hash(seed, Purpose::ray)),
      clutter_seed_(hash(seed, Purpose::clutter)) {}

bool Lidar::is_disturbed(std::size_t index, std::size_t scans) const noexcept {
  const double driven = static_cast<double>(index) / static_cast<double>(scans);
  return params_.disturbed_from <= driven && driven < params_.disturbed_to;
}

bool Lidar::is_covered(int firing) const noexcept {
  if (!params_.covered_from || !params_.covered_to) return false;
  constexpr double kRounding = 1e-9;
  const double azimuth = 180.0 - 360.0 * firing / params_.firings();
  double width = *params_.covered_to - *params_.covered_from;
  if (width <= 0.0) width += 360.0;
  double inside = azimuth - *params_.covered_from;  // made to lie in [0, 360)
  if (inside < -kRounding) inside += 360.0;
  if (inside >= 360.0 - kRounding) inside -= 360.0;
  return inside <= width + kRounding;
}

std::optional<double> Lidar::cluttered(const std::optional<Hit>& hit, const Ray& ray) const {
  if (params_.clutter == 0.0) return std::nullopt;
  Random random(hash(clutter_seed_, ray.scan, ray.firing, ray.ring));
  const double farthest =
      std::min({kFarthestClutter, params_.max_range, hit ? hit->range : kFarthestClutter});
  if (!random.chance(params_.clutter) || farthest <= params_.min_range) return std::nullopt;
  return random.uniform(params_.min_range, farthest);
}

std::optional<double> Lidar::returned(const std::optional<Hit>& hit, const Ray& ray) const {
  if (!hit) return std::nullopt;
  Random random(hash(seed_, ray.scan, ray.firing, ray.ring));
  const double grazing = std::asin(hit->cos_incidence) / kDegree;
  const double lost = grazing < params_.grazing_angle
                          ? std::max(params_.dropout, 1.0 - grazing / params_.grazing_angle)
                          : params_.dropout;
  if (random.chance(lost)) return std::nullopt;
  const double range = hit->range + params_.range_noise * random.normal();
  if (range < params_.min_range || range > params_.max_range) return std::nullopt;
  return range;
}

Eigen::Vector3d Lidar::direction(int firing, int ring) const noexcept {
  const double azimuth = std::numbers::pi - 2.0 * std::numbers::pi * firing / params_.firings();
  const double step =
      params_.rings > 1 ? (params_.highest_ring - params_.lowest_ring) / (params_.rings - 1) : 0.0;
  const double elevation = (params_.lowest_ring + ring * step) * kDegree;
  return {std::cos(elevation) * std::cos(azimuth), std::cos(elevation) * std::sin(azimuth),
          std::sin(elevation)};
}

PointCloud Lidar::scan(const World& world, const Drive& drive, std::size_t index) const {
  return sweep(world, drive, index).points;
}

Sweep Lidar::sweep(const World& world, const Drive& drive, std::size_t index) const {
  const int firings = params_.firings();
  const double stamp = drive.stamp(index);
  const bool disturbed = is_disturbed(index, drive.scans());
  Sweep sweep;
  Pose pose = drive.pose(stamp);
  Eigen::Matrix3d rotation = pose.rotation.toRotationMatrix();
  for (int firing = 0; firing < firings; ++firing) {
    if (disturbed && is_covered(firing)) continue;
    const double seconds = firing / (params_.rate * firings);
    if (params_.motion_distortion) {
      pose = drive.pose(stamp + seconds);
      rotation = pose.rotation.toRotationMatrix();
    }
    for (int ring = 0; ring < params_.rings; ++ring) {
      const Eigen::Vector3d ahead = direction(firing, ring);
      const auto hit =
          world.cast(pose.translation, (rotation * ahead).normalized(), params_.max_range);
      const Ray ray{index, firing, ring};
      auto range = disturbed ? cluttered(hit, ray) : std::nullopt;
      if (!range) range = returned(hit, ray);
      if (!range) continue;
      sweep.points.emplace_back(*range * ahead);
      if (params_.motion_distortion) sweep.seconds.push_back(static_cast<float>(seconds));
    }
  }
  return sweep;
}

}  // namespace vantage::simulation
