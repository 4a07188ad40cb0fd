#include "live/static_frames.hpp"

namespace vantage::live {

using io::ros::frame_name;

Result<void> StaticFrames::add(const io::ros::PoseMessage& transform) {
  if (!transform.problem.empty()) return fail(ErrorCode::corrupt_data, transform.problem);
  const std::string parent(frame_name(transform.header.frame)), child(frame_name(transform.child));
  if (!tree_.add(parent, child)) {
    return fail(ErrorCode::corrupt_data,
                "there are more than 10000 pairs of frames, expected those of one robot");
  }
  poses_[{.parent = parent, .child = child}] = transform.pose;
  return {};
}

Result<std::optional<Pose>> StaticFrames::pose(std::string_view parent,
                                               std::string_view child) const {
  const std::string to(frame_name(parent)), from(frame_name(child));
  if (to == from) return Pose{};
  VANTAGE_TRY(const auto path, tree_.path(to, from, "/tf_static"));
  if (!path) return std::nullopt;
  Pose product;
  for (const auto& [edge, is_inverse] : *path) {
    const Pose& pose = poses_.at(edge);
    product = product * (is_inverse ? pose.inverse() : pose);
  }
  return product;
}

}  // namespace vantage::live
