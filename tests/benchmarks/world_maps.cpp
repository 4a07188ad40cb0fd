#include "world_maps.hpp"

#include <fmt/format.h>

#include <Eigen/SVD>
#include <array>
#include <cmath>
#include <cstdint>
#include <numbers>
#include <set>
#include <utility>

#include "integrity_worlds.hpp"
#include "simulate/random.hpp"

namespace vantage::benchmarks {
namespace {

constexpr double kPi = std::numbers::pi;
constexpr std::uint64_t kOtherPlace = 5000;  // added to the seed
constexpr double kSurveyVoxel = 0.12;        // one point in each [m]
constexpr int kSurveyEvery = 10;             // revolutions: 1.5 m

/// Turns the middle of the campus, and bends it more and more towards its border.
Point bent(const Point& p, double bend, const simulation::CampusParams& campus) {
  const double u = kPi * (p.x() - campus.origin_x) / campus.size_x;
  const double v = kPi * (p.y() - campus.origin_y) / campus.size_y;
  return p + bend * Point(std::sin(v), -std::sin(u), 0.3 * std::sin(u + v));
}

/// The first point of each voxel.
PointCloud thinned(const PointCloud& points, double voxel) {
  std::set<std::array<std::int64_t, 3>> taken;
  PointCloud kept;
  for (const Point& p : points) {
    const auto cell = [&](double x) { return static_cast<std::int64_t>(std::floor(x / voxel)); };
    if (taken.insert({cell(p.x()), cell(p.y()), cell(p.z())}).second) kept.push_back(p);
  }
  return kept;
}

Result<PointCloud> surveyed(simulation::WorldParams params, simulation::SensorModel model) {
  params.lidar = simulation::lidar_of(model);
  params.lidar.motion_distortion = false;
  params.changes = {};
  simulation::DriveParams lap;
  lap.route = params.drive.route;
  lap.scan_every = kSurveyEvery;
  lap.lateral_offset = -params.drive.lateral_offset;
  params.drive = lap;
  const auto noise_seed = hash(params.seed, 0x50e7eU);
  VANTAGE_TRY(const SimulatedDrive drive, simulated_drive(params, 0, noise_seed));
  PointCloud map;
  for (std::size_t i = 0; i < drive.scans.size(); ++i) {
    PointCloud there;
    for (const Point& p : drive.scans[i]) there.push_back(drive.reference[i].pose * p);
    there = thinned(there, kSurveyVoxel);
    map.insert(map.end(), there.begin(), there.end());
  }
  return thinned(map, kSurveyVoxel);
}

}  // namespace

std::string MapDifference::key() const {
  return fmt::format("{} {} {} {} {} {} {}", second_copy.x(), second_copy.y(), second_copy.z(),
                     bend, only_half, surveyed_by ? static_cast<int>(*surveyed_by) : -1,
                     of_another_place);
}

Pose bent(const Pose& T_map_sensor, double bend, const simulation::CampusParams& campus) {
  constexpr double kStep = 0.01;  // [m]
  const Point& p = T_map_sensor.translation;
  Eigen::Matrix3d jacobian;
  for (Eigen::Index axis = 0; axis < 3; ++axis) {
    const Point step = kStep * Point::Unit(axis);
    jacobian.col(axis) =
        (bent(Point(p + step), bend, campus) - bent(Point(p - step), bend, campus)) / (2.0 * kStep);
  }
  // The rotation that is nearest to the Jacobian.
  const Eigen::JacobiSVD<Eigen::Matrix3d> svd(jacobian, Eigen::ComputeFullU | Eigen::ComputeFullV);
  const Eigen::Quaterniond turn(Eigen::Matrix3d(svd.matrixU() * svd.matrixV().transpose()));
  return {.rotation = (turn * T_map_sensor.rotation).normalized(),
          .translation = bent(p, bend, campus)};
}

Result<PointCloud> map_of(const simulation::WorldParams& params, const MapDifference& difference) {
  simulation::WorldParams there = params;
  if (difference.of_another_place) there.seed += kOtherPlace;
  VANTAGE_TRY(PointCloud map, difference.surveyed_by ? surveyed(there, *difference.surveyed_by)
                                                     : simulated_map(there));
  if (difference.only_half) {
    std::erase_if(map, [&](const Point& p) { return p.x() > params.campus.origin_x; });
  }
  if (difference.bend != 0.0) {
    for (Point& p : map) p = bent(p, difference.bend, params.campus);
  }
  if (difference.second_copy != Point::Zero()) {
    const std::size_t once = map.size();
    for (std::size_t i = 0; i < once; ++i) map.push_back(map[i] + difference.second_copy);
  }
  return map;
}

}  // namespace vantage::benchmarks
