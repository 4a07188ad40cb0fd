#include "vantage/io/sensor_trajectory.hpp"

#include <doctest/doctest.h>

#include "files.hpp"
#include "io/ros/message_writers.hpp"
#include "ros_messages.hpp"
#include "support/bags/bags.hpp"

namespace vantage {
namespace {

using test::check_clear;
using test::MessageWriter;
using test::TemporaryFolder;
using test::TestMessage;

constexpr std::int64_t kSecond = 1'000'000'000;  // [ns]

Pose pose(double x, double yaw) {
  return {Eigen::Quaterniond(Eigen::AngleAxisd(yaw, Eigen::Vector3d::UnitZ())), {x, 0.0, 0.0}};
}

/// nav_msgs/Odometry of base_link.
TestMessage odometry(std::int64_t seconds) {
  MessageWriter message(MessageWriter::Layout::cdr_little);
  message.header(static_cast<std::uint32_t>(seconds), 0, "odom").text("base_link");
  message.numbers(std::array{static_cast<double>(seconds), 0.0, 0.0, 0.0, 0.0, 0.0, 1.0});
  message.numbers(std::array<double, 36>{});
  message.numbers(std::array<double, 6>{});
  message.numbers(std::array<double, 36>{});
  return {"/odom", "nav_msgs/msg/Odometry", kSecond * seconds, message.bytes()};
}

TestMessage tf_static() {
  const std::vector<io::ros::PoseMessage> transforms{
      {.header = {.stamp = 1.0, .frame = "base_link"},
       .child = "velodyne",
       .pose = pose(0.5, 0.25),
       .problem = {}}};
  return {"/tf_static", "tf2_msgs/msg/TFMessage", kSecond,
          io::ros::write_transforms(transforms).value()};
}

std::filesystem::path bag(const TemporaryFolder& folder, const std::string& name,
                          bool with_static) {
  std::vector<TestMessage> messages{odometry(1), odometry(2)};
  if (with_static) messages.push_back(tf_static());
  return test::put(folder.path() / name, test::mcap(messages));
}

void check_carried(const Result<io::SensorTrajectory>& poses, const Pose& T_base_sensor) {
  REQUIRE_MESSAGE(poses, to_string(poses.error()));
  REQUIRE(poses->poses.size() == 2);
  for (const io::StampedPose& moment : poses->poses) {
    const Pose expected = pose(moment.stamp, 0.0) * T_base_sensor;
    CHECK((moment.pose.translation - expected.translation).norm() < 1e-12);
    CHECK(rotation_between(moment.pose, expected) < 1e-7);
  }
}

TEST_CASE("sensor trajectory: a vehicle's poses are carried to its sensor") {
  const TemporaryFolder folder;
  const auto plain = bag(folder, "plain.mcap", false);
  const auto with_static = bag(folder, "static.mcap", true);
  SUBCASE("by the transforms of the same bag") {
    check_carried(io::read_sensor_trajectory({with_static, "", 10.0}, {.name = "velodyne"}),
                  pose(0.5, 0.25));
  }
  SUBCASE("by those of the scans' bag, whose frames may begin with a slash") {
    check_carried(io::read_sensor_trajectory({plain, "/odom", 10.0},
                                             {.name = "/velodyne", .scans = with_static}),
                  pose(0.5, 0.25));
  }
  SUBCASE("as the user says") {
    check_carried(
        io::read_sensor_trajectory({with_static, "", 10.0},
                                   {.name = "velodyne", .T_child_sensor = pose(1.0, -0.5)}),
        pose(1.0, -0.5));
  }
  SUBCASE("the user's mount counts if the scans name no frame") {
    check_carried(io::read_sensor_trajectory({plain, "", 10.0},
                                             {.name = "", .T_child_sensor = pose(1.0, -0.5)}),
                  pose(1.0, -0.5));
  }
  SUBCASE("not at all if they are the sensor's, whatever the user says of others") {
    check_carried(io::read_sensor_trajectory(
                      {plain, "", 10.0}, {.name = "base_link", .T_child_sensor = pose(1.0, -0.5)}),
                  Pose());
  }
  SUBCASE("not at all, if they are the sensor's or nobody knows") {
    for (const char* name : {"base_link", ""}) {
      check_carried(io::read_sensor_trajectory({plain, "", 10.0}, {.name = name}), Pose());
    }
  }
}

TEST_CASE("sensor trajectory: frames that nothing connects") {
  const TemporaryFolder folder;
  const auto plain = bag(folder, "plain.mcap", false);
  const auto poses =
      io::read_sensor_trajectory({plain, "", 10.0}, {.name = "velodyne", .scans = plain});
  REQUIRE_FALSE(poses);
  check_clear(poses.error(), ErrorCode::invalid_input, "plain.mcap",
              "the poses of /odom are those of frame 'base_link', the scans are in frame "
              "'velodyne', and no /tf_static connects them; say with --mount");
}

TEST_CASE("sensor trajectory: a bag that is cut off gives the poses before the cut, and says it") {
  const TemporaryFolder folder;
  const std::vector<TestMessage> messages{tf_static(), odometry(1), odometry(2), odometry(3)};
  const std::string whole = test::mcap(messages, {.messages_in_chunk = 1});
  const std::size_t last = test::mcap({tf_static(), odometry(1), odometry(2)},
                                      {.indexed = false, .messages_in_chunk = 1})
                               .size();
  const auto path = test::put(folder.path() / "cut.mcap", whole.substr(0, last));
  const auto poses = io::read_sensor_trajectory({path, "", 10.0}, {.name = "velodyne"});
  check_carried(poses, pose(0.5, 0.25));
  REQUIRE(poses->damage);
  check_clear(*poses->damage, ErrorCode::corrupt_data, "cut.mcap", "the file ends at byte");
  const auto complete = bag(folder, "whole.mcap", true);
  CHECK_FALSE(io::read_sensor_trajectory({complete, "", 10.0}, {.name = "velodyne"})->damage);
}

TEST_CASE("sensor trajectory: text files hold the sensor's poses and have no topics") {
  const TemporaryFolder folder;
  const auto file = test::put(folder.path() / "a.tum", "1 1 0 0 0 0 0 1\n2 2 0 0 0 0 0 1\n");
  check_carried(io::read_sensor_trajectory({file, "", 10.0}, {.name = "velodyne"}), Pose());
  const auto refused = io::read_sensor_trajectory({file, "/odom", 10.0}, {.name = "velodyne"});
  REQUIRE_FALSE(refused);
  check_clear(refused.error(), ErrorCode::invalid_input, "a.tum", "no topics");
}

}  // namespace
}  // namespace vantage
