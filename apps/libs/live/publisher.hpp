#pragma once

#include <cstdint>
#include <map>
#include <optional>
#include <string>
#include <vector>

#include "dds/participant.hpp"
#include "io/ros/message_writers.hpp"
#include "live/live_params.hpp"
#include "live/notices.hpp"
#include "live/session.hpp"
#include "vantage/point_cloud.hpp"
#include "vantage/pose.hpp"
#include "vantage/result.hpp"

namespace vantage::live {

/// What a session publishes.
enum class Output : std::uint8_t { pose, pose_stamped, odometry, transforms, map, diagnostics };

/// The topic of an output.
struct OutputTopic {
  Output output;
  dds::Topic topic;
};

/// What a configuration publishes, /tf included unless it is not wanted; with a `followed_pose`,
/// the map alone.
[[nodiscard]] std::vector<OutputTopic> output_topics(const LiveParams& params);

/// A message for a topic: CDR with its header.
struct Publication {
  Output output;
  std::string message;
};

/// T_map_base and its covariance (rows as in io::ros::PoseCovariance) from those of the sensor.
struct RobotPose {
  Pose T_map_base;
  Eigen::Matrix<double, 6, 6, Eigen::DontAlign> covariance;
};
[[nodiscard]] RobotPose robot_pose(const Localized& scan);

/// The message for the robot's motion between scans. Errors: `invalid_input` for a stamp that is no
/// time of ROS.
[[nodiscard]] Result<std::string> odometry_message(const FrameParams& frames, const Moved& moved);

/// Makes the messages that tell a robot what was found.
class Publisher {
 public:
  explicit Publisher(LiveParams params) : params_(std::move(params)) {}

  /// The messages for a scan, without a map. A pose is published if the scan is tracked, or as
  /// LiveParams::publish says; without one, the last transform from map to odom goes on.
  /// @param region  the label of the scan's region
  /// @param counts  what went wrong so far, by kind
  /// Errors: `invalid_input` for a stamp that is no time of ROS.
  [[nodiscard]] Result<std::vector<Publication>> messages(
      const Localized& scan, const std::string& region,
      const std::map<std::string, std::uint64_t>& counts);

  /// The diagnostics while no scan is localized. Errors: as above.
  /// @param stamp  this moment
  [[nodiscard]] Result<std::string> diagnostics(
      const Idle& idle, io::ros::Stamp stamp,
      const std::map<std::string, std::uint64_t>& counts) const;

 private:
  [[nodiscard]] bool is_published(const ScanReport& report) const;
  [[nodiscard]] Result<std::optional<std::string>> transform(const Localized& scan,
                                                             const std::optional<RobotPose>& pose);
  [[nodiscard]] Result<std::string> diagnostics(
      io::ros::Stamp stamp, io::ros::Diagnostic status,
      const std::map<std::string, std::uint64_t>& counts) const;

  LiveParams params_;
  std::optional<Pose> T_map_odom_;
};

/// The message for a region's map, stamped 0: it holds at all times. Tells if its coordinates are
/// float64, because float32 would move them.
[[nodiscard]] Result<std::string> map_message(const FrameParams& frames, PointsView points,
                                              Notices& notices);

}  // namespace vantage::live
