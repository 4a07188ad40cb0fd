#include "simulate/lidar.hpp"

#include <algorithm>
#include <cmath>
#include <numbers>

#include "simulate/random.hpp"

namespace vantage::simulation {
namespace {

constexpr double kDegree = std::numbers::pi / 180.0;
constexpr double kFarthestClutter = 15.0;  // [m]

double fraction_of(double x) { return x - std::floor(x); }

}  // namespace

Lidar::Lidar(const LidarParams& params, std::uint64_t seed)
    : params_(params),
      seed_(hash(seed, Purpose::ray)),
      clutter_seed_(hash(seed, Purpose::clutter)),
      angle_seed_(hash(seed, Purpose::ray_angle)),
      crowd_(params, seed) {}

bool Lidar::is_disturbed(std::size_t index, std::size_t scans) const noexcept {
  const double driven = static_cast<double>(index) / static_cast<double>(scans);
  return params_.disturbed_from <= driven && driven < params_.disturbed_to;
}

bool Lidar::is_covered(double azimuth) const noexcept {
  if (!params_.covered_from || !params_.covered_to) return false;
  constexpr double kRounding = 1e-9;
  double width = *params_.covered_to - *params_.covered_from;
  if (width <= 0.0) width += 360.0;
  double inside = azimuth / kDegree - *params_.covered_from;  // made to lie in [0, 360)
  while (inside < -kRounding) inside += 360.0;
  while (inside >= 360.0 - kRounding) inside -= 360.0;
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
  double lost = params_.dropout;
  if (grazing < params_.grazing_angle) {
    lost = std::max(lost, 1.0 - grazing / params_.grazing_angle);
  }
  if (hit->range > params_.sure_range) {
    lost = std::max(lost,
                    (hit->range - params_.sure_range) / (params_.max_range - params_.sure_range));
  }
  if (random.chance(lost)) return std::nullopt;
  const double range = hit->range + params_.range_noise * random.normal();
  if (range < params_.min_range || range > params_.max_range) return std::nullopt;
  return range;
}

double Lidar::azimuth(int firing, std::size_t number) const noexcept {
  const double begun = fraction_of(params_.turns * static_cast<double>(number));  // of a turn
  return std::numbers::pi - 2.0 * std::numbers::pi * begun -
         2.0 * std::numbers::pi * (params_.turns * firing) / params_.firings();
}

double Lidar::elevation(int firing, int ring, std::size_t number) const noexcept {
  const double lowest = params_.lowest_ring, highest = params_.highest_ring;
  if (params_.sweeps > 0.0) {
    const double done =
        fraction_of(params_.sweeps * (static_cast<double>(number) +
                                      static_cast<double>(firing) / params_.firings()));
    const double up = 1.0 - std::abs(2.0 * done - 1.0);  // 0, up to 1 and down again
    const double room = highest - lowest - (params_.rings - 1) * params_.ring_spacing;
    return (lowest + up * room + ring * params_.ring_spacing) * kDegree;
  }
  const int lower = params_.rings - params_.upper_rings;
  if (ring >= lower) {
    return (highest - (params_.rings - 1 - ring) * params_.upper_spacing) * kDegree;
  }
  const double top = highest - params_.upper_rings * params_.upper_spacing;  // of the lower ones
  const double step = lower > 1 ? (top - lowest) / (lower - 1) : 0.0;
  return (lowest + ring * step) * kDegree;
}

Eigen::Vector3d Lidar::direction(int firing, int ring, std::size_t number) const noexcept {
  const double a = azimuth(firing, number), e = elevation(firing, ring, number);
  return {std::cos(e) * std::cos(a), std::cos(e) * std::sin(a), std::sin(e)};
}

Eigen::Vector3d Lidar::reported(const Eigen::Vector3d& direction, const Ray& ray) const {
  if (params_.angle_noise == 0.0) return direction;
  Random random(hash(angle_seed_, ray.scan, ray.firing, ray.ring));
  const double noise = params_.angle_noise * kDegree;
  const double a = std::atan2(direction.y(), direction.x()) + noise * random.normal();
  const double e = std::asin(std::clamp(direction.z(), -1.0, 1.0)) + noise * random.normal();
  return {std::cos(e) * std::cos(a), std::cos(e) * std::sin(a), std::sin(e)};
}

PointCloud Lidar::scan(const World& world, const Drive& drive, std::size_t index) const {
  return sweep(world, drive, index).points;
}

Sweep Lidar::sweep(const World& world, const Drive& drive, std::size_t index) const {
  const int firings = params_.firings();
  const double stamp = drive.stamp(index);
  const bool disturbed = is_disturbed(index, drive.scans());
  const std::size_t number = drive.sweep_number(index);
  Sweep sweep;
  Pose pose = drive.pose(stamp);
  Eigen::Matrix3d rotation = pose.rotation.toRotationMatrix();
  for (int firing = 0; firing < firings; ++firing) {
    if (disturbed && is_covered(azimuth(firing, number))) continue;
    const double seconds = firing / (params_.rate * firings);
    if (params_.motion_distortion) {
      pose = drive.pose(stamp + seconds);
      rotation = pose.rotation.toRotationMatrix();
    }
    for (int ring = 0; ring < params_.rings; ++ring) {
      const Eigen::Vector3d ahead = direction(firing, ring, number);
      const Eigen::Vector3d ray_direction = (rotation * ahead).normalized();
      auto hit = world.cast(pose.translation, ray_direction, params_.max_range);
      if (disturbed) hit = crowd_.before(hit, ray_direction, stamp + seconds - drive.stamp(0));
      const Ray ray{index, firing, ring};
      auto range = disturbed ? cluttered(hit, ray) : std::nullopt;
      if (!range) range = returned(hit, ray);
      if (!range) continue;
      sweep.points.emplace_back(*range * reported(ahead, ray));
      if (params_.motion_distortion) sweep.seconds.push_back(static_cast<float>(seconds));
    }
  }
  return sweep;
}

}  // namespace vantage::simulation
