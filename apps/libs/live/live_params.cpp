#include "live/live_params.hpp"

#include <arpa/inet.h>

#include <array>

namespace vantage::live {

std::optional<Pose> FrameParams::mount() const {
  if (!T_base_sensor) return std::nullopt;
  const std::vector<double>& x = *T_base_sensor;
  return pose_from_xyz_rpy({x[0], x[1], x[2]}, {x[3], x[4], x[5]});
}

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

Result<void> FoxgloveParams::validate() const {
  std::array<std::byte, sizeof(in6_addr)> bytes;
  if (inet_pton(AF_INET, address.c_str(), bytes.data()) != 1 &&
      inet_pton(AF_INET6, address.c_str(), bytes.data()) != 1) {
    return fail_at({"address"}, "'" + address +
                                    "' is no address, expected one of IPv4 or IPv6 like 127.0.0.1 "
                                    "or ::1");
  }
  if (layout && !port) return fail_at({"layout"}, "'layout' needs a 'port': there is no server");
  return {};
}

Result<void> LiveParams::validate() const {
  if (topics.points.empty()) {
    return fail_at({"topics.points"}, "'points' is empty: a localizer needs scans");
  }
  if (!topics.fix.empty() && !map_projector) {
    return fail_at({"topics.fix", "map_projector"},
                   "'fix' has latitudes and longitudes: 'map_projector' must say where the map is");
  }
  if (!topics.followed_pose.empty() && topics.map.empty()) {
    return fail_at({"topics.followed_pose", "topics.map"},
                   "'followed_pose' needs the topic 'map': nothing else is published");
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
