#include "live/static_frames.hpp"

#include <fmt/format.h>

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

namespace {

constexpr std::int64_t kMovesFor = 10'000'000'000;  // after its last transform [ns]

}  // namespace

void StaticFrames::add_moving(const io::ros::PoseMessage& transform, std::int64_t arrival) {
  const std::string child(frame_name(transform.child));
  if (moving_.size() >= kMostMoving && !moving_.contains(child)) {
    std::erase_if(moving_,
                  [&](const auto& one) { return arrival - one.second.arrival > kMovesFor; });
    if (moving_.size() >= kMostMoving) return;
  }
  moving_[child] = {.parent = std::string(frame_name(transform.header.frame)), .arrival = arrival};
}

std::optional<std::string> StaticFrames::second_parent(std::string_view parent,
                                                       std::string_view child,
                                                       std::int64_t now) const {
  const auto path =
      tree_.path(std::string(frame_name(parent)), std::string(frame_name(child)), "/tf_static");
  if (!path || !*path) return std::nullopt;
  for (const auto& [edge, is_inverse] : **path) {
    const auto found = moving_.find(edge.child);
    if (found == moving_.end() || now - found->second.arrival > kMovesFor) continue;
    if (found->second.parent == frame_name(edge.parent)) continue;
    return fmt::format("the frame '{}' has the parent '{}' in /tf_static, and '{}' in /tf",
                       edge.child, edge.parent, found->second.parent);
  }
  return std::nullopt;
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
