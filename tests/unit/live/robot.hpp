#pragma once

#include <doctest/doctest.h>

#include <algorithm>
#include <cstdint>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "io/ros/message_writers.hpp"
#include "live/session.hpp"
#include "support/post_world.hpp"

namespace vantage::live::test_world {

inline constexpr double kStart = 1700000000.0;  // [s]

inline std::int64_t ns(double seconds) { return static_cast<std::int64_t>(seconds * 1e9); }

/// A session in a world of posts, and a robot that drives along x at 1 m/s.
struct Robot {
  test::PostWorld world;
  std::vector<std::string> told;
  Notices notices{[this](const std::string& text) { told.push_back(text); }};
  Session session;

  explicit Robot(const LiveParams& params = {}, const std::optional<Pose>& kept = test::at_x(5.0),
                 std::optional<io::MapProjection> projection = {})
      : session(world.localizer(), params, kept, notices, std::move(projection)) {}

  static LiveParams with_mount() {
    LiveParams params;
    params.frames.T_base_sensor = std::vector<double>{0.0, 0.0, 1.0, 0.0, 0.0, 0.0};
    return params;
  }

  void give(Input input, double time, Result<std::string> message) {
    REQUIRE(message);
    session.take({.input = input, .arrival = ns(time), .message = *std::move(message)});
  }
  void scan(double stamp, const char* frame = "lidar") {
    world.stand_at(test::at_x(5.0 + (stamp - kStart)));
    give(Input::points, stamp,
         io::ros::write_point_cloud2({.stamp = stamp, .frame = frame}, world.scan));
  }
  void imu(double stamp, double force = 9.81) {
    give(Input::imu, stamp,
         io::ros::write_imu({.stamp = stamp, .frame = "imu"}, {0, 0, 0}, {0, 0, force}));
  }
  void odometry(double stamp) {
    give(Input::odometry, stamp,
         io::ros::write_odometry({.stamp = stamp, .frame = "odom"}, "base_link",
                                 test::at_x(stamp - kStart)));
  }
  std::optional<Localized> localize() {
    auto done = session.localize();
    REQUIRE_MESSAGE(done, to_string(done.error()));
    return *std::move(done);
  }
  bool was_told(const std::string& text) const {
    return std::ranges::any_of(
        told, [&](const std::string& line) { return line.find(text) != std::string::npos; });
  }
};

/// The request of std_srvs/SetBool.
inline std::string set_bool(bool data) { return {0, 1, 0, 0, data ? '\1' : '\0'}; }

}  // namespace vantage::live::test_world
