#include "live/publisher.hpp"

#include <fmt/format.h>

#include <array>
#include <utility>

#include "live/diagnostics.hpp"

namespace vantage::live {
namespace {

using io::ros::Diagnostic;
using io::ros::Header;

/// From the sensor to the robot: a rotation about the sensor moves what is away from it.
template <class Covariance>
RobotPose robot_of(const Pose& T_map_sensor, const Covariance& covariance,
                   const Pose& T_base_sensor) {
  RobotPose robot{.T_map_base = T_map_sensor * T_base_sensor.inverse(), .covariance = covariance};
  Eigen::Matrix<double, 6, 6> J = Eigen::Matrix<double, 6, 6>::Identity();
  J.topRightCorner<3, 3>() = -skew(robot.T_map_base.translation - T_map_sensor.translation);
  robot.covariance = J * robot.covariance * J.transpose();
  return robot;
}

}  // namespace

std::vector<OutputTopic> output_topics(const LiveParams& params) {
  std::vector<OutputTopic> outputs;
  const auto add = [&](Output output, const std::string& name, const char* type, dds::Qos qos) {
    if (!name.empty()) outputs.push_back({output, {.name = name, .type = type, .qos = qos}});
  };
  const dds::Qos latched{.reliable = true, .transient_local = true, .depth = 1};
  if (!params.topics.followed_pose.empty()) {
    add(Output::map, params.topics.map, "sensor_msgs/PointCloud2", latched);
    return outputs;
  }
  add(Output::pose, params.topics.pose, "geometry_msgs/PoseWithCovarianceStamped", latched);
  add(Output::pose_stamped, params.topics.pose_stamped, "geometry_msgs/PoseStamped",
      {.reliable = true, .depth = 10});
  add(Output::odometry, params.topics.filtered_odometry, "nav_msgs/Odometry",
      {.reliable = true, .depth = 100});
  if (params.transform_in_use() != Transform::none) {
    add(Output::transforms, "/tf", "tf2_msgs/TFMessage", {.reliable = true, .depth = 100});
  }
  add(Output::map, params.topics.map, "sensor_msgs/PointCloud2", latched);
  add(Output::diagnostics, params.topics.diagnostics, "diagnostic_msgs/DiagnosticArray",
      {.reliable = true, .depth = 10});
  return outputs;
}

RobotPose robot_pose(const Localized& scan) {
  using Covariance = Eigen::Matrix<double, 6, 6, Eigen::DontAlign>;
  const auto& confidence = scan.report.confidence;
  const Covariance covariance =
      confidence ? Covariance(confidence->covariance) : Covariance::Zero();
  return robot_of(scan.report.T_map_scan, covariance, scan.T_base_sensor);
}

Result<std::string> odometry_message(const FrameParams& frames, const Moved& moved) {
  const SensorMotion& motion = moved.motion;
  const RobotPose robot = robot_of(motion.T_map_sensor, motion.covariance, moved.T_base_sensor);
  const Eigen::Matrix3d R = moved.T_base_sensor.rotation.toRotationMatrix();
  const Eigen::Vector3d base_in_sensor = moved.T_base_sensor.inverse().translation;
  const Twist& twist = motion.twist;
  return io::ros::write_odometry(
      {.stamp = moved.stamp, .frame = frames.map}, frames.base, robot.T_map_base, robot.covariance,
      {.linear = R * (twist.linear + twist.angular.cross(base_in_sensor)),
       .angular = R * twist.angular});
}

bool Publisher::is_published(const ScanReport& report) const {
  if (!report.has_pose) return false;
  if (report.tracking == Tracking::tracked) return true;
  return params_.publish == Publish::uncertain && report.tracking == Tracking::uncertain;
}

Result<std::optional<std::string>> Publisher::transform(const Localized& scan,
                                                        const std::optional<RobotPose>& pose) {
  io::ros::PoseMessage message{
      .header = {.stamp = scan.stamp, .frame = params_.frames.map}, .child = {}, .pose = {}};
  switch (params_.transform_in_use()) {
    case Transform::map_to_base:
      if (!pose) return std::nullopt;
      message.child = params_.frames.transform_child.value_or(params_.frames.base);
      message.pose = pose->T_map_base;
      break;
    case Transform::map_to_odom:
      if (pose && scan.T_odom_base) T_map_odom_ = pose->T_map_base * scan.T_odom_base->inverse();
      if (!T_map_odom_) return std::nullopt;
      message.header.stamp = scan.stamp + params_.transform_tolerance;
      message.child = params_.frames.odom;
      message.pose = *T_map_odom_;
      break;
    case Transform::automatic:
    case Transform::none: return std::nullopt;
  }
  VANTAGE_TRY(std::string bytes, io::ros::write_transforms(std::array{std::move(message)}));
  return bytes;
}

Result<std::vector<Publication>> Publisher::messages(
    const Localized& scan, const std::string& region,
    const std::map<std::string, std::uint64_t>& counts) {
  const ScanReport& report = scan.report;
  std::optional<RobotPose> pose;
  if (is_published(report)) pose = robot_pose(scan);
  std::vector<Publication> messages;
  const Header header{.stamp = scan.stamp, .frame = params_.frames.map};
  VANTAGE_TRY(auto transform_bytes, transform(scan, pose));
  if (transform_bytes) messages.push_back({Output::transforms, *std::move(transform_bytes)});
  if (pose && !params_.topics.pose.empty()) {
    VANTAGE_TRY(std::string bytes,
                io::ros::write_pose_with_covariance(header, pose->T_map_base, pose->covariance));
    messages.push_back({Output::pose, std::move(bytes)});
  }
  if (pose && !params_.topics.pose_stamped.empty()) {
    VANTAGE_TRY(std::string bytes, io::ros::write_pose_stamped(header, pose->T_map_base));
    messages.push_back({Output::pose_stamped, std::move(bytes)});
  }
  if (params_.topics.diagnostics.empty()) return messages;
  const std::string state = to_string(report.tracking);
  Diagnostic status{.level = level_of(report),
                    .name = {},
                    .message = message_of(report),
                    .values = {{"tracking", state},
                               {"risk", fmt::format("{:.3g}", report.risk)},
                               {"region", region},
                               {"outside", report.outside ? "yes" : "no"},
                               {"align_s", fmt::format("{:.4f}", report.seconds_align)},
                               {"verdict_s", fmt::format("{:.4f}", report.seconds_verdict)},
                               {"search_s", fmt::format("{:.4f}", report.seconds_search)},
                               {"stall_s", fmt::format("{:.4f}", report.seconds_stall)},
                               {"scan_s", fmt::format("{:.4f}", scan.seconds)},
                               {"map_bytes", fmt::format("{}", report.held_bytes)},
                               {"scan_points", fmt::format("{}", report.scan_points)},
                               {"doubted_s", fmt::format("{:.4f}", report.seconds_doubted)},
                               {"dropped_samples", fmt::format("{}", report.dropped_samples)}}};
  VANTAGE_TRY(std::string bytes, diagnostics(scan.stamp, std::move(status), counts));
  messages.push_back({Output::diagnostics, std::move(bytes)});
  return messages;
}

Result<std::string> Publisher::diagnostics(
    const Idle& idle, io::ros::Stamp stamp,
    const std::map<std::string, std::uint64_t>& counts) const {
  return diagnostics(
      stamp, {.level = idle.level, .name = {}, .message = idle.message, .values = {}}, counts);
}

Result<std::string> Publisher::diagnostics(
    io::ros::Stamp stamp, Diagnostic status,
    const std::map<std::string, std::uint64_t>& counts) const {
  status.name = params_.node + ": localization";
  for (const auto& [kind, count] : counts) status.values.emplace_back(kind, std::to_string(count));
  return io::ros::write_diagnostics({.stamp = stamp, .frame = params_.frames.map},
                                    std::array{std::move(status)});
}

Result<std::string> map_message(const FrameParams& frames, PointsView points, Notices& notices) {
  const io::ros::Coordinates coordinates = io::ros::coordinates_for(points);
  if (coordinates == io::ros::Coordinates::float64) {
    notices.tell("maps_in_float64",
                 "the map is so far from its origin that float32 would move points by more than "
                 "1 mm: x, y and z are published as float64, which RViz and PCL do not read");
  }
  return io::ros::write_point_cloud2({.stamp = 0.0, .frame = frames.map}, points, {}, coordinates);
}

}  // namespace vantage::live
