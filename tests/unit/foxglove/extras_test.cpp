#include "foxglove/extras.hpp"

#include <doctest/doctest.h>

#include <cstring>
#include <string>

#include "io/ros/message_writers.hpp"
#include "io/ros/messages.hpp"
#include "io/ros/schemas.hpp"
#include "protocol.hpp"

namespace vantage::foxglove {
namespace {

live::Localized tracked_at(double stamp, double x) {
  live::Localized scan;
  scan.report.tracking = Tracking::tracked;
  scan.report.risk = 0.25;
  scan.report.T_map_scan = pose_from_xyz_rpy({x, 0.0, 0.0}, {0.0, 0.0, 0.0});
  scan.stamp = stamp;
  const auto message =
      io::ros::write_point_cloud2({.stamp = stamp, .frame = "lidar"}, PointsView{});
  REQUIRE(message);
  scan.received.message = *message;
  return scan;
}

/// What a topic gets for a scan, or "".
std::string extra(Extras& extras, const live::Localized& scan, const std::string& topic) {
  const auto messages = extras.messages(scan);
  REQUIRE(messages);
  for (const auto& one : *messages) {
    CHECK(io::ros::schema_of(one.topic.type));
    if (one.topic.name == topic) return one.bytes;
  }
  return {};
}

/// The poses of a nav_msgs/Path whose frames are "map".
std::uint64_t poses_in(const std::string& path) {
  // The header of CDR, a time, the frame "map" with its length.
  REQUIRE(path.size() >= 24);
  return test::little_endian(std::string_view(path).substr(20, 4));
}

TEST_CASE("extras: the risk of each scan is a number") {
  Extras extras({});
  const std::string risk = extra(extras, tracked_at(1.0, 0.0), "/vantage/risk");
  REQUIRE(risk.size() == 12);
  double value = 0.0;
  std::memcpy(&value, risk.data() + 4, sizeof value);
  CHECK(value == 0.25);
}

TEST_CASE("extras: the path goes on by half metres, is sent once a second, and has an end") {
  Extras extras({});
  const auto path = [&](double stamp, double x) {
    return extra(extras, tracked_at(stamp, x), "/vantage/path");
  };
  CHECK(poses_in(path(0.0, 0.0)) == 1);
  CHECK(path(0.5, 1.0).empty());
  CHECK(poses_in(path(1.0, 1.2)) == 2);
  CHECK(poses_in(path(2.0, 1.6)) == 3);
  // Whole messages: each pose has a time, a frame of 4 characters and seven numbers, which begin at
  // multiples of 8.
  CHECK(path(3.0, 3.0).size() == 4 + 20 + 4 + 4 * (16 + 56));
  // A clock that is set back stops nothing.
  CHECK(poses_in(path(1.5, 4.0)) == 5);
  for (int i = 0; i < 2000; ++i) (void)path(10.0 + 0.01 * i, 10.0 + i);
  CHECK(poses_in(path(100.0, 10.0)) == 1000);
  live::Localized lost = tracked_at(200.0, 500.0);
  lost.report.tracking = Tracking::lost;
  CHECK(extra(extras, lost, "/vantage/path").empty());
}

TEST_CASE("extras: transforms that come as odometry or from the configuration are drawn, too") {
  live::Localized scan = tracked_at(1.0, 0.0);
  scan.T_odom_base = pose_from_xyz_rpy({5.0, 0.0, 0.0}, {0.0, 0.0, 0.0});
  Extras none({});
  CHECK(extra(none, scan, "/tf").empty());
  live::LiveParams params;
  params.topics.odometry = "/odom";
  params.frames.T_base_sensor = std::vector<double>{0.0, 0.0, 2.0, 0.0, 0.0, 0.0};
  scan.T_base_sensor = pose_from_xyz_rpy({0.0, 0.0, 2.0}, {0.0, 0.0, 0.0});
  Extras both(params);
  const auto transforms = io::ros::parse_poses(extra(both, scan, "/tf"), "tf2_msgs/TFMessage",
                                               io::ros::Encoding::cdr, {});
  REQUIRE(transforms);
  REQUIRE(transforms->size() == 2);
  CHECK((*transforms)[0].header.frame == "odom");
  CHECK((*transforms)[0].child == "base_link");
  CHECK((*transforms)[0].pose.translation.x() == 5.0);
  CHECK((*transforms)[1].header.frame == "base_link");
  CHECK((*transforms)[1].child == "lidar");
  CHECK((*transforms)[1].pose.translation.z() == 2.0);
}

}  // namespace
}  // namespace vantage::foxglove
