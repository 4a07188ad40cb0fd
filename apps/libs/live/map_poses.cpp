#include "live/map_poses.hpp"

#include <fmt/format.h>

#include "io/ros/transform_tree.hpp"
#include "vantage/track/samples.hpp"

namespace vantage::live {

Result<std::vector<io::ros::PoseMessage>> poses_in_map(Input input, const std::string& message,
                                                       const std::string& map_frame,
                                                       Notices& notices) {
  VANTAGE_TRY(auto poses, io::ros::parse_poses(message, "geometry_msgs/PoseWithCovarianceStamped",
                                               io::ros::Encoding::cdr, {}));
  std::vector<io::ros::PoseMessage> found;
  for (auto& one : poses) {
    const std::string frame(io::ros::frame_name(one.header.frame));
    if (frame != map_frame) {
      notices.tell(
          fmt::format("{}_in_other_frame", name_of(input)),
          fmt::format("a pose is given in the frame '{}', expected '{}'", frame, map_frame));
      continue;
    }
    if (!is_on_earth(one.pose)) {
      return fail(ErrorCode::corrupt_data, "a pose is farther away than 1e8 m");
    }
    found.push_back(std::move(one));
  }
  return found;
}

}  // namespace vantage::live
