#include "foxglove/extras.hpp"

#include <cmath>
#include <utility>

#include "io/ros/cdr_writer.hpp"
#include "io/ros/message_writers.hpp"
#include "io/ros/transform_tree.hpp"
#include "live/publisher.hpp"

namespace vantage::foxglove {
namespace {

using io::ros::Header;

constexpr double kStep = 0.5;        // between poses of the path [m]
constexpr double kPathPeriod = 1.0;  // [s]
constexpr std::size_t kLongestPath = 1000;

Result<std::string> float64(double value) {
  io::ros::CdrWriter out;
  out.number(value);
  return std::move(out).finish();
}

}  // namespace

Result<std::string> Extras::path() const {
  io::ros::CdrWriter out;
  const auto header = [&](const Header& h) -> Result<void> {
    VANTAGE_TRY(const auto time, h.stamp.time());
    out.number(time.sec);
    out.number(time.nanosec);
    out.text(h.frame);
    return {};
  };
  VANTAGE_CHECK(header(path_.back().header));
  out.count(path_.size());
  for (const auto& one : path_) {
    VANTAGE_CHECK(header(one.header));
    for (const double x : one.pose.translation) out.number(x);
    for (const double x : one.pose.rotation.coeffs()) out.number(x);
  }
  return std::move(out).finish();
}

Result<std::vector<Extras::Message>> Extras::messages(const live::Localized& scan) {
  std::vector<Message> messages;
  VANTAGE_TRY(std::string risk, float64(scan.report.risk));
  messages.push_back({{.name = kRiskTopic, .type = "std_msgs/Float64"}, std::move(risk)});

  std::vector<io::ros::PoseMessage> transforms;
  const auto add = [&](const std::string& frame, const std::string& child, const Pose& pose) {
    transforms.push_back(
        {.header = {.stamp = scan.stamp, .frame = frame}, .child = child, .pose = pose});
  };
  if (params_.transform_in_use() == live::Transform::map_to_odom && scan.T_odom_base) {
    add(params_.frames.odom, params_.frames.base, *scan.T_odom_base);
  }
  if (params_.frames.T_base_sensor) {
    VANTAGE_TRY(const Header header,
                io::ros::parse_header(scan.received.message, io::ros::Encoding::cdr, {}));
    const std::string sensor(io::ros::frame_name(header.frame));
    if (sensor != params_.frames.base) add(params_.frames.base, sensor, scan.T_base_sensor);
  }
  if (!transforms.empty()) {
    VANTAGE_TRY(std::string bytes, io::ros::write_transforms(transforms));
    messages.push_back({{.name = "/tf", .type = "tf2_msgs/TFMessage"}, std::move(bytes)});
  }

  if (scan.report.tracking != Tracking::tracked) return messages;
  const Pose T_map_base = live::robot_pose(scan).T_map_base;
  if (path_.empty() || (T_map_base.translation - path_.back().pose.translation).norm() >= kStep) {
    path_.push_back({.header = {.stamp = scan.stamp, .frame = params_.frames.map},
                     .child = {},
                     .pose = T_map_base});
    if (path_.size() > kLongestPath) path_.pop_front();
  }
  if (path_sent_ && std::abs(scan.stamp.seconds() - *path_sent_) < kPathPeriod) return messages;
  path_sent_ = scan.stamp.seconds();
  VANTAGE_TRY(std::string bytes, path());
  messages.push_back({{.name = kPathTopic,
                       .type = "nav_msgs/Path",
                       .qos = {.reliable = true, .transient_local = true, .depth = 1}},
                      std::move(bytes)});
  return messages;
}

}  // namespace vantage::foxglove
