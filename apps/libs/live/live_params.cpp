#include "live/live_params.hpp"

namespace vantage::live {

Result<void> FrameParams::validate() const {
  if (T_base_sensor && T_base_sensor->size() != 6) {
    return fail_at({"T_base_sensor"}, "'T_base_sensor' has " +
                                          std::to_string(T_base_sensor->size()) +
                                          " numbers, expected 6: x, y, z, roll, pitch, yaw");
  }
  if (map == base || map == odom || odom == base) {
    return fail_at({"map", "odom", "base"}, "'map', 'odom' and 'base' must be different frames");
  }
  return {};
}

Result<void> LiveParams::validate() const {
  if (topics.points.empty()) {
    return fail_at({"topics.points"}, "'points' is empty: a localizer needs scans");
  }
  if (transform == Transform::map_to_odom && topics.odometry.empty()) {
    return fail_at({"transform"}, "'map_to_odom' needs the topic 'odometry' in [live.topics]");
  }
  if (start == Start::wait && topics.initial_pose.empty()) {
    return fail_at({"start"}, "'wait' needs the topic 'initial_pose' in [live.topics]");
  }
  return {};
}

}  // namespace vantage::live
