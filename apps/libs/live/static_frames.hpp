#pragma once

#include <cstddef>
#include <cstdint>
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
  /// A transform of /tf, whose frames move. It is known for 10 s: a node that went publishes no
  /// longer, and one that is there does so more often.
  /// @param arrival  as Received::arrival [ns]
  void add_moving(const io::ros::PoseMessage& transform, std::int64_t arrival);
  /// A frame between two that has a parent in /tf as well: a sentence, or nothing.
  /// @param now  as Received::arrival [ns]
  [[nodiscard]] std::optional<std::string> second_parent(std::string_view parent,
                                                         std::string_view child,
                                                         std::int64_t now) const;
  /// T_parent_child; nothing if the frames are not connected.
  /// Errors: those of TransformTree::path.
  [[nodiscard]] Result<std::optional<Pose>> pose(std::string_view parent,
                                                 std::string_view child) const;

 private:
  static constexpr std::size_t kMostMoving = 10'000;

  io::ros::TransformTree tree_;
  std::map<io::ros::TransformTree::Edge, Pose> poses_;
  struct Moving {
    std::string parent;
    std::int64_t arrival;
  };
  std::map<std::string, Moving, std::less<>> moving_;  // by child
};

}  // namespace vantage::live
