#include "live/publisher.hpp"

#include <doctest/doctest.h>

#include <cmath>
#include <random>

#include "io/ros/messages.hpp"
#include "vantage/track/rotation.hpp"

namespace vantage::live {
namespace {

using io::ros::Encoding;

Localized tracked(double stamp, const Pose& T_map_sensor, const Pose& T_base_sensor) {
  Localized scan{
      .report = {}, .scan = {}, .stamp = stamp, .received = {}, .T_base_sensor = T_base_sensor};
  scan.report.stamp = stamp;
  scan.report.tracking = Tracking::tracked;
  scan.report.T_map_scan = T_map_sensor;
  return scan;
}

const Publication* of(const std::vector<Publication>& all, Output output) {
  for (const Publication& one : all) {
    if (one.output == output) return &one;
  }
  return nullptr;
}

io::ros::PoseMessage transform_in(const std::vector<Publication>& all) {
  const Publication* const found = of(all, Output::transforms);
  REQUIRE(found != nullptr);
  return io::ros::parse_poses(found->message, "tf2_msgs/TFMessage", Encoding::cdr, {})->front();
}

void check_near(const Pose& a, const Pose& b) {
  CHECK((a.translation - b.translation).norm() < 1e-12);
  CHECK(rotation_between(a, b) < 1e-7);
}

TEST_CASE("map -> odom leads from the map over odometry and mount to the sensor") {
  LiveParams params;
  params.topics.odometry = "/odom";
  Publisher publisher(params);
  const Pose T_map_sensor = pose_from_xyz_rpy({10, 20, 3}, {0.1, -0.2, 2.0});
  const Pose T_base_sensor = pose_from_xyz_rpy({0.5, 0.1, 1.5}, {0.0, 0.05, 0.3});
  const Pose T_odom_base = pose_from_xyz_rpy({-3, 4, 0}, {0.0, 0.0, -1.0});
  Localized scan = tracked(1700000000.25, T_map_sensor, T_base_sensor);
  scan.T_odom_base = T_odom_base;
  const auto messages = publisher.messages(scan, "r", {}).value();
  const auto transform = transform_in(messages);
  CHECK(transform.header.frame == "map");
  CHECK(transform.child == "odom");
  CHECK(double(transform.header.stamp) == doctest::Approx(1700000000.35).epsilon(1e-15));
  check_near(transform.pose * T_odom_base * T_base_sensor, T_map_sensor);

  SUBCASE("it goes on while the scan is lost, without a pose") {
    Localized lost = scan;
    lost.report.tracking = Tracking::lost;
    lost.stamp = 1700000000.35;
    const auto then = publisher.messages(lost, "r", {}).value();
    check_near(transform_in(then).pose, transform.pose);
    CHECK(of(then, Output::pose) == nullptr);
    CHECK(of(then, Output::diagnostics) != nullptr);
  }
}

TEST_CASE("without odometry, map -> base_link is published, and only of tracked scans") {
  Publisher publisher(LiveParams{});
  const Pose T_base_sensor = pose_from_xyz_rpy({0, 0, 2}, {0, 0, 0});
  Localized scan =
      tracked(io::ros::Stamp(5.0, 7), pose_from_xyz_rpy({1, 2, 3}, {0, 0, 0}), T_base_sensor);
  scan.stamp = io::ros::Stamp(1700000000.0, 123456789);
  const auto messages = publisher.messages(scan, "r", {}).value();
  const auto transform = transform_in(messages);
  CHECK(transform.child == "base_link");
  CHECK(transform.pose.translation.z() == 1.0);
  CHECK(transform.header.stamp.time()->nanosec == 123456789);
  scan.report.tracking = Tracking::uncertain;
  CHECK(of(publisher.messages(scan, "r", {}).value(), Output::transforms) == nullptr);
}

TEST_CASE("the covariance of the robot is that of samples of the sensor's pose") {
  std::mt19937 random(1);
  std::normal_distribution<double> normal;
  Eigen::Matrix<double, 6, 6> half = Eigen::Matrix<double, 6, 6>::Zero();
  for (int i = 0; i < 36; ++i) half(i / 6, i % 6) = 0.01 * normal(random);
  Localized scan = tracked(1.0, pose_from_xyz_rpy({5, 6, 7}, {0.3, 0.1, 1.0}),
                           pose_from_xyz_rpy({2, -1, 1.5}, {0.0, 0.2, 0.5}));
  scan.report.confidence.emplace();
  scan.report.confidence->covariance = half * half.transpose();
  const RobotPose robot = robot_pose(scan);
  Eigen::Matrix<double, 6, 6> sampled = Eigen::Matrix<double, 6, 6>::Zero();
  constexpr int kSamples = 20'000;
  for (int i = 0; i < kSamples; ++i) {
    Eigen::Matrix<double, 6, 1> x;
    for (double& value : x) value = normal(random);
    const Eigen::Matrix<double, 6, 1> error = half * x;
    Pose moved = scan.report.T_map_scan;
    moved.translation += error.head<3>();
    moved.rotation = rotation_from_vector(error.tail<3>()) * moved.rotation;
    const Pose base = moved * scan.T_base_sensor.inverse();
    Eigen::Matrix<double, 6, 1> difference;
    difference.head<3>() = base.translation - robot.T_map_base.translation;
    difference.tail<3>() = error.tail<3>();
    sampled += difference * difference.transpose() / kSamples;
  }
  CHECK((sampled - robot.covariance).norm() < 0.05 * sampled.norm());
}

TEST_CASE("a map far from its origin is published as it is and reported once") {
  std::vector<std::string> told;
  Notices notices([&](const std::string& text) { told.push_back(text); });
  const PointCloud near{{1.25, 2.5, 3.0}}, far{{690000.125, 5334000.003, 512.7}};
  const auto points_of = [&](const PointCloud& map) {
    const auto message = map_message({}, map, notices).value();
    return io::ros::parse_point_cloud2(message, Encoding::cdr, {}).value().cloud.points;
  };
  CHECK(points_of(near) == near);
  CHECK(told.empty());
  CHECK(points_of(far) == far);
  CHECK(points_of(far) == far);
  CHECK(told.size() == 1);
  CHECK(notices.count_of("maps_in_float64") == 2);
}

}  // namespace
}  // namespace vantage::live
