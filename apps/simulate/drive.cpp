#include "simulate/drive.hpp"

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <iterator>
#include <numbers>
#include <utility>

namespace vantage::simulation {

namespace {

std::optional<Pose> mount_of(const LidarParams& lidar) {
  const Eigen::Vector3d angles(lidar.roll, lidar.pitch, lidar.yaw);
  if (angles.isZero(0.0)) return std::nullopt;
  return pose_from_xyz_rpy(Eigen::Vector3d::Zero(), std::numbers::pi / 180.0 * angles);
}

}  // namespace

Result<Drive> Drive::create(const World& world, const WorldParams& params) {
  VANTAGE_TRY(const auto crossings, world.streets().route(params.drive.route));
  Route route(crossings, params.drive.lateral_offset, params.drive.turn_radius);
  Pace pace(params.drive, params.drive.length.value_or(route.length()));
  VANTAGE_TRY(Events events, plan_events(route, params, pace));
  return Drive(world, params, std::move(route), std::move(pace), std::move(events));
}

Drive::Drive(const World& world, const WorldParams& params, Route route, Pace pace, Events events)
    : world_(&world),
      route_(std::move(route)),
      pace_(std::move(pace)),
      roughness_(params.drive, params.seed),
      events_(std::move(events)),
      start_time_(params.drive.start_time),
      seconds_per_scan_(seconds_per_scan(params)),
      seconds_per_sweep_(1.0 / params.lidar.rate),
      height_(params.lidar.height),
      T_body_sensor_(mount_of(params.lidar)),
      scans_(number_of_scans(params, pace_)),
      scan_every_(static_cast<std::size_t>(params.drive.scan_every)) {}

double Drive::stamp(std::size_t i) const noexcept {
  return start_time_ + static_cast<double>(i) * seconds_per_scan_;
}

double Drive::distance(double stamp) const noexcept { return pace_.distance(stamp - start_time_); }

double Drive::ahead(double stamp) const noexcept {
  const auto after = std::find_if(events_.kidnaps.begin(), events_.kidnaps.end(),
                                  [&](const Kidnap& k) { return this->stamp(k.scan) > stamp; });
  return after == events_.kidnaps.begin() ? 0.0 : std::prev(after)->ahead;
}

Pose Drive::pose(double stamp) const noexcept {
  return pose_on_route(stamp - start_time_, ahead(stamp));
}

double Drive::end() const noexcept { return stamp(scans_ - 1) + seconds_per_sweep_; }

Pose Drive::pose_near(double seconds, double moment) const noexcept {
  return pose_on_route(seconds, ahead(start_time_ + moment));
}

bool Drive::is_kidnapped(std::size_t i) const noexcept {
  return std::any_of(events_.kidnaps.begin(), events_.kidnaps.end(),
                     [&](const Kidnap& k) { return k.scan == i; });
}

Pose Drive::pose_driven_on(std::size_t i) const noexcept {
  double ahead = 0.0;
  for (const Kidnap& kidnap : events_.kidnaps) {
    if (kidnap.scan < i) ahead = kidnap.ahead;
  }
  return pose_on_route(stamp(i) - start_time_, ahead);
}

bool Drive::is_in_hole(std::size_t i) const noexcept {
  const Point position = pose(stamp(i)).translation;
  return std::any_of(events_.holes.begin(), events_.holes.end(),
                     [&](const Hole& hole) { return hole.contains(position.head<2>()); });
}

Pose Drive::pose_on_route(double seconds, double ahead_of_it) const noexcept {
  const double distance = pace_.distance(seconds) + ahead_of_it;
  const Eigen::Vector2d position = route_.position(distance);
  const Eigen::Vector2d direction = route_.direction(distance);
  const Eigen::Vector3d up = world_->terrain().normal(position);
  const Eigen::Vector3d ahead(direction.x(), direction.y(), 0.0);
  Eigen::Matrix3d axes;
  axes.col(0) = (ahead - up * up.dot(ahead)).normalized();
  axes.col(1) = up.cross(axes.col(0));
  axes.col(2) = up;
  Pose pose;
  pose.rotation = Eigen::Quaterniond(axes).normalized();
  pose.translation = {position.x(), position.y(), world_->terrain().height(position) + height_};
  if (!roughness_.is_none()) {
    const Pose stand = roughness_.stand(distance);
    const Eigen::Vector3d height(0.0, 0.0, height_);
    pose.translation += pose.rotation * Eigen::Vector3d(stand * height - height);
    pose.rotation = (pose.rotation * stand.rotation).normalized();
  }
  if (const double turned = pace_.turned(seconds); turned != 0.0) {
    pose.rotation =
        (pose.rotation * rotation_from_vector(turned * Eigen::Vector3d::UnitZ())).normalized();
  }
  return T_body_sensor_ ? pose * *T_body_sensor_ : pose;
}

}  // namespace vantage::simulation
