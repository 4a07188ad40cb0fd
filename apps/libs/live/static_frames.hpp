#pragma once

#include <cstddef>
#include <functional>
#include <map>
#include <optional>
#include <span>
#include <string>
#include <string_view>

#include "io/ros/messages.hpp"
#include "io/ros/transform_tree.hpp"
#include "vantage/pose.hpp"
#include "vantage/result.hpp"

namespace vantage::live {

/// The frames of a robot that do not move against each other.
class StaticFrames {
 public:
  /// A later transform between the same frames replaces the earlier.
  /// Errors: `corrupt_data` for an invalid pose, and for more frames than a robot has.
  [[nodiscard]] Result<void> add(const io::ros::PoseMessage& transform);
  /// A transform of /tf, whose frames move.
  void add_moving(const io::ros::PoseMessage& transform);
  /// A frame between two that has a parent in /tf as well: a sentence, or nothing.
  [[nodiscard]] std::optional<std::string> second_parent(std::string_view parent,
                                                         std::string_view child) const;
  /// T_parent_child; nothing if the frames are not connected.
  /// Errors: those of TransformTree::path.
  [[nodiscard]] Result<std::optional<Pose>> pose(std::string_view parent,
                                                 std::string_view child) const;

 private:
  static constexpr std::size_t kMostMoving = 10'000;

  io::ros::TransformTree tree_;
  std::map<io::ros::TransformTree::Edge, Pose> poses_;
  std::map<std::string, std::string, std::less<>> moving_;  // child -> parent
};

}  // namespace vantage::live
