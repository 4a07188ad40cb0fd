#include "localize/motion.hpp"

#include <utility>

namespace vantage {

Pose Motion::predict(const Scan& scan) const {
  if (scan.odometry && last_->odometry) {
    return last_->T_map_scan * (last_->odometry->inverse() * *scan.odometry);
  }
  const std::optional<Step> before = step();
  if (!before) return last_->T_map_scan;
  const double fraction = (scan.stamp - last_->stamp) / before->seconds;
  return last_->T_map_scan * interpolate(Pose{}, before->T_now_later, fraction);
}

std::optional<Motion::Step> Motion::step() const {
  if (!before_last_) return {};
  return Step{before_last_->T_map_scan.inverse() * last_->T_map_scan,
              last_->stamp - before_last_->stamp};
}

std::optional<Motion::Step> Motion::step_to(const Scan& scan) const {
  if (last_ && last_->odometry && scan.odometry) {
    return Step{last_->odometry->inverse() * *scan.odometry, scan.stamp - last_->stamp};
  }
  return step();
}

Eigen::Vector3d Motion::velocity() const {
  if (!before_last_) return Eigen::Vector3d::Zero();
  return (last_->T_map_scan.translation - before_last_->T_map_scan.translation) /
         (last_->stamp - before_last_->stamp);
}

void Motion::add(const Scan& scan, const Pose& T_map_scan) {
  before_last_ = std::exchange(last_, Moment{scan.stamp, T_map_scan, scan.odometry});
}

void Motion::correct(const Pose& T_map_scan) {
  if (before_last_) {
    before_last_->T_map_scan =
        T_map_scan * (last_->T_map_scan.inverse() * before_last_->T_map_scan);
  }
  last_->T_map_scan = T_map_scan;
}

void Motion::forget() {
  before_last_.reset();
  last_.reset();
}

}  // namespace vantage
