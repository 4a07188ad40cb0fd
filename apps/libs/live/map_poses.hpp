#pragma once

#include <string>
#include <vector>

#include "io/ros/messages.hpp"
#include "live/notices.hpp"
#include "live/received.hpp"
#include "vantage/result.hpp"

namespace vantage::live {

/// The poses of a geometry_msgs/PoseWithCovarianceStamped. One in another frame than the map's is
/// told and left out.
/// Errors: those of parse_poses; `corrupt_data` for a pose off the earth.
[[nodiscard]] Result<std::vector<io::ros::PoseMessage>> poses_in_map(Input input,
                                                                     const std::string& message,
                                                                     const std::string& map_frame,
                                                                     Notices& notices);

}  // namespace vantage::live
