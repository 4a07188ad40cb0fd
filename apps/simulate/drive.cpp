#include "simulate/drive.hpp"

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>

namespace vantage::simulation {

Result<Drive> Drive::create(const World& world, const WorldParams& params) {
  VANTAGE_TRY(const auto crossings, world.streets().route(params.drive.route));
  return Drive(world, params,
               Route(crossings, params.drive.lateral_offset, params.drive.turn_radius));
}

Drive::Drive(const World& world, const WorldParams& params, Route route)
    : world_(&world),
      route_(std::move(route)),
      speed_(params.drive.speed),
      start_time_(params.drive.start_time),
      seconds_per_scan_(params.drive.scan_every / params.lidar.rate),
      height_(params.lidar.height) {
  const double length = params.drive.length.value_or(route_.length());
  scans_ = std::max(std::size_t{1},
                    static_cast<std::size_t>(std::ceil(length / (speed_ * seconds_per_scan_))));
}

double Drive::stamp(std::size_t i) const noexcept {
  return start_time_ + static_cast<double>(i) * seconds_per_scan_;
}

double Drive::distance(double stamp) const noexcept { return speed_ * (stamp - start_time_); }

Pose Drive::pose(double stamp) const noexcept {
  const Eigen::Vector2d position = route_.position(distance(stamp));
  const Eigen::Vector2d direction = route_.direction(distance(stamp));
  const Eigen::Vector3d up = world_->terrain().normal(position);
  const Eigen::Vector3d ahead(direction.x(), direction.y(), 0.0);
  Eigen::Matrix3d axes;
  axes.col(0) = (ahead - up * up.dot(ahead)).normalized();
  axes.col(1) = up.cross(axes.col(0));
  axes.col(2) = up;
  Pose pose;
  pose.rotation = Eigen::Quaterniond(axes).normalized();
  pose.translation = {position.x(), position.y(), world_->terrain().height(position) + height_};
  return pose;
}

}  // namespace vantage::simulation
