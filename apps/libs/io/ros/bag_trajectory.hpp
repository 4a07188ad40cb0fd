#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "io/ros/message_reader.hpp"
#include "io/ros/messages.hpp"
#include "vantage/io/trajectory_io.hpp"
#include "vantage/pose.hpp"
#include "vantage/result.hpp"

namespace vantage::io::ros {

/// Where `child` was in `frame`: T_frame_child at each stamp. Frame names have no leading slash.
struct BagTrajectory {
  Trajectory poses;
  /// Of each pose, as far as the messages state them; empty for transforms.
  std::vector<std::optional<PoseVariances>> variances;
  std::string frame;
  std::string child;  ///< empty if the messages do not say it
  std::string topic;
  std::string stamp_rule;     ///< a sentence that says where the stamps come from
  std::uint64_t skipped = 0;  ///< poses stamped no later than the one before; for transforms, also
                              ///< stamps at which part of the chain is unknown
  std::optional<Error> damage;  ///< at which a bag that is cut off or damaged ends
};

/// Reads the whole bag (twice, for transforms) and selects other topics.
/// @param topic_spec
///   - "/odom": a topic of nav_msgs/Odometry, geometry_msgs/PoseStamped,
///     PoseWithCovarianceStamped or TransformStamped; empty for the only topic of the first three
///     types. Stamps are those of the headers, or log times if the first header has none (0).
///   - "/tf:map:base_link": the pose of frame base_link in map, from transforms
/// (tf2_msgs/TFMessage,
///     tf/tfMessage) of that topic and of /tf_static, over the frames between them. Stamps are
///     those of the transform sent most often; the others are interpolated as by pose_at.
/// Errors (`where` is the file): `invalid_input` with a list, for a topic or a frame that does not
/// exist or must be chosen; `corrupt_data` for a frame on the way that has two parents or is above
/// itself, for frames that change within a topic, and for a bag without a pose; those of
/// MessageReader and parse_poses.
[[nodiscard]] Result<BagTrajectory> read_bag_trajectory(MessageReader& reader,
                                                        std::string_view topic_spec);

/// T_parent_child from /tf_static, which is assumed to hold at all times; the last one if a
/// transform was sent several times. Nothing if the frames are not connected there.
/// Errors: those of read_bag_trajectory for transforms. Selects other topics.
[[nodiscard]] Result<std::optional<Pose>> static_transform(MessageReader& reader,
                                                           std::string_view parent,
                                                           std::string_view child);

}  // namespace vantage::io::ros
