#pragma once

#include <deque>
#include <optional>
#include <string>
#include <vector>

#include "dds/participant.hpp"
#include "io/ros/messages.hpp"
#include "live/live_params.hpp"
#include "live/session.hpp"
#include "vantage/result.hpp"

namespace vantage::foxglove {

inline constexpr const char *kRiskTopic = "/vantage/risk", *kPathTopic = "/vantage/path";

/// What a picture needs and DDS does not get from this node:
///   /vantage/risk  std_msgs/Float64, of each scan: a number that can be plotted
///   /vantage/path  nav_msgs/Path, once a second of the scans: the robot's tracked poses, half a
///                  metre apart, the last 1000
///   /tf            odom -> base, which comes as odometry, and base -> sensor if the configuration
///                  says it, so that scans are drawn in the map
class Extras {
 public:
  explicit Extras(live::LiveParams params) : params_(std::move(params)) {}

  struct Message {
    dds::Topic topic;
    std::string bytes;  ///< CDR
  };
  /// For a scan. Errors: `invalid_input` for a stamp that is no time of ROS; those of
  /// io::ros::parse_header for what the scan was read from.
  [[nodiscard]] Result<std::vector<Message>> messages(const live::Localized& scan);

 private:
  [[nodiscard]] Result<std::string> path() const;

  live::LiveParams params_;
  std::deque<io::ros::PoseMessage> path_;
  std::optional<double> path_sent_;  // stamp of a scan [s]
};

}  // namespace vantage::foxglove
