#include "foxglove/pose_message.hpp"

#include <doctest/doctest.h>

#include <array>
#include <string>
#include <vector>

#include "io/ros/message_writers.hpp"
#include "io/ros/messages.hpp"
#include "protocol.hpp"

namespace vantage::foxglove {
namespace {

using test::Json;
using test::pose_in_json;

constexpr const char* kStamped = "geometry_msgs/PoseStamped";
constexpr const char* kWithCovariance = "geometry_msgs/PoseWithCovarianceStamped";

io::ros::PoseMessage read(const std::string& message) {
  const auto poses = io::ros::parse_poses(message, kWithCovariance, io::ros::Encoding::cdr, {});
  REQUIRE(poses);
  REQUIRE(poses->size() == 1);
  return poses->front();
}

Json with_covariance(const Json& covariance) {
  Json json = pose_in_json();
  json["pose"] = {{"pose", json["pose"]}, {"covariance", covariance}};
  return json;
}

TEST_CASE("given_pose: JSON of PoseStamped gets the variances of a hand") {
  for (const char* const type : {kStamped, "geometry_msgs/msg/PoseStamped"}) {
    CAPTURE(type);
    const auto message = given_pose(type, kJson, pose_in_json().dump());
    REQUIRE(message);
    const auto pose = read(*message);
    CHECK(pose.header.frame == "map");
    CHECK(pose.header.stamp.time()->nanoseconds() == 12'000'000'500);
    CHECK(pose.pose.translation == Eigen::Vector3d(1.5, -2.0, 0.0));
    CHECK(pose.pose.rotation.z() == doctest::Approx(0.6));
    REQUIRE(pose.variances);
    CHECK(pose.variances->translation == std::array{0.25, 0.25, 0.0});
    CHECK(pose.variances->heading == doctest::Approx(0.0685).epsilon(0.01));
  }
}

TEST_CASE("given_pose: JSON of PoseWithCovarianceStamped, with its covariance") {
  Json covariance = std::vector<double>(36, 0.0);
  covariance[0] = 4.0;
  covariance[35] = 0.5;
  const auto message = given_pose(kWithCovariance, kJson, with_covariance(covariance).dump());
  REQUIRE(message);
  const auto pose = read(*message);
  REQUIRE(pose.variances);
  CHECK(pose.variances->translation == std::array{4.0, 0.0, 0.0});
  CHECK(pose.variances->heading == 0.5);
}

TEST_CASE("given_pose: nanoseconds as ROS 2 spells them") {
  Json json = pose_in_json();
  json["header"]["stamp"] = {{"sec", 3}, {"nanosec", 7}};
  const auto message = given_pose(kStamped, kJson, json.dump());
  REQUIRE(message);
  CHECK(read(*message).header.stamp.time()->nanoseconds() == 3'000'000'007);
}

TEST_CASE("given_pose: CDR with a covariance stays as it is, CDR of PoseStamped gets one") {
  const io::ros::Header header{.stamp = 2.5, .frame = "map"};
  const Pose pose = pose_from_xyz_rpy({1.0, 2.0, 3.0}, {0.0, 0.0, 0.5});
  const auto full =
      io::ros::write_pose_with_covariance(header, pose, io::ros::PoseCovariance::Identity());
  REQUIRE(full);
  const auto same = given_pose(kWithCovariance, kCdr, *full);
  REQUIRE(same);
  CHECK(*same == *full);
  const auto stamped = io::ros::write_pose_stamped(header, pose);
  REQUIRE(stamped);
  const auto made = given_pose(kStamped, kCdr, *stamped);
  REQUIRE(made);
  CHECK(read(*made).pose.translation == pose.translation);
  CHECK(read(*made).variances->translation[0] == 0.25);
}

TEST_CASE("given_pose: what is no pose is refused, and what is missing is named") {
  const auto refusal = [](const char* type, std::string_view encoding, const std::string& bytes) {
    const auto message = given_pose(type, encoding, bytes);
    REQUIRE_FALSE(message);
    return message.error();
  };
  const std::string good = pose_in_json().dump();
  CHECK(refusal("std_msgs/String", kJson, good).code == ErrorCode::unsupported);
  CHECK(refusal(kStamped, "ros1", good).code == ErrorCode::unsupported);
  for (const char* const bytes : {"", "[]", "{", "null", "7"}) {
    CAPTURE(bytes);
    CHECK(refusal(kStamped, kJson, bytes).code == ErrorCode::corrupt_data);
    CHECK(refusal(kStamped, kCdr, bytes).code == ErrorCode::corrupt_data);
  }
  const auto without = [&](const char* path) {
    Json json = pose_in_json();
    const Json::json_pointer at(path);
    json[at.parent_pointer()].erase(at.back());
    return refusal(kStamped, kJson, json.dump()).message;
  };
  CHECK(without("/header").find("'header'") != std::string::npos);
  CHECK(without("/header/stamp/sec").find("'sec'") != std::string::npos);
  CHECK(without("/header/frame_id").find("'frame_id'") != std::string::npos);
  CHECK(without("/pose/position/y").find("'y'") != std::string::npos);
  CHECK(without("/pose/orientation").find("'orientation'") != std::string::npos);
  Json json = pose_in_json();
  json["header"]["stamp"]["sec"] = 5e9;
  CHECK(refusal(kStamped, kJson, json.dump()).message.find("'sec'") != std::string::npos);
  json = pose_in_json();
  json["pose"]["orientation"]["w"] = 7;
  CHECK(refusal(kStamped, kJson, json.dump()).code == ErrorCode::corrupt_data);
  CHECK(refusal(kWithCovariance, kJson, with_covariance({1, 2, 3}).dump())
            .message.find("'covariance'") != std::string::npos);
}

}  // namespace
}  // namespace vantage::foxglove
