#include "simulate/lidar.hpp"

#include <algorithm>
#include <cmath>
#include <numbers>

#include "simulate/random.hpp"

namespace vantage::simulation {
namespace {

constexpr double kDegree = std::numbers::pi / 180.0;

}  // namespace

Lidar::Lidar(const LidarParams& params, std::uint64_t seed)
    : params_(params), seed_(hash(seed, Purpose::ray)) {}

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
  Sweep sweep;
  Pose pose = drive.pose(stamp);
  Eigen::Matrix3d rotation = pose.rotation.toRotationMatrix();
  for (int firing = 0; firing < firings; ++firing) {
    const double seconds = firing / (params_.rate * firings);
    if (params_.motion_distortion) {
      pose = drive.pose(stamp + seconds);
      rotation = pose.rotation.toRotationMatrix();
    }
    for (int ring = 0; ring < params_.rings; ++ring) {
      const Eigen::Vector3d ray = direction(firing, ring);
      const auto hit =
          world.cast(pose.translation, (rotation * ray).normalized(), params_.max_range);
      if (!hit) continue;
      Random random(hash(seed_, index, firing, ring));
      const double grazing = std::asin(hit->cos_incidence) / kDegree;
      const double lost = grazing < params_.grazing_angle
                              ? std::max(params_.dropout, 1.0 - grazing / params_.grazing_angle)
                              : params_.dropout;
      if (random.chance(lost)) continue;
      const double range = hit->range + params_.range_noise * random.normal();
      if (range < params_.min_range || range > params_.max_range) continue;
      sweep.points.emplace_back(range * ray);
      if (params_.motion_distortion) sweep.seconds.push_back(static_cast<float>(seconds));
    }
  }
  return sweep;
}

}  // namespace vantage::simulation
