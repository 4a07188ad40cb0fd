#include "io/ros/bag_trajectory.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <map>
#include <utility>
#include <vector>

#include "io/ros/message_reading.hpp"
#include "io/ros/messages.hpp"
#include "io/ros/topic_choice.hpp"
#include "io/ros/transform_tree.hpp"
#include "io/text.hpp"

namespace vantage::io::ros {
namespace {

constexpr std::array<std::string_view, 2> kTransforms{"tf2_msgs/TFMessage", "tf/tfMessage"};
constexpr std::string_view kStaticTopic = "/tf_static";

using Topics = std::vector<std::size_t>;
using Edge = TransformTree::Edge;
using Path = TransformTree::Path;

TopicNeed poses_needed() {
  return {.what = "poses",
          .choices = {{"nav_msgs/Odometry", "geometry_msgs/PoseStamped",
                       "geometry_msgs/PoseWithCovarianceStamped"}},
          .by_name = {"geometry_msgs/TransformStamped", kTransforms[0], kTransforms[1]}};
}

struct TopicSpec {
  std::string_view topic, parent, child;  // no frames unless transforms are wanted
};

Result<TopicSpec> parse_spec(const std::string& file, std::string_view text) {
  const std::size_t first = text.find(':');
  if (first == std::string_view::npos) return TopicSpec{text, {}, {}};
  const std::string_view frames = text.substr(first + 1);
  const std::size_t second = frames.find(':');
  TopicSpec spec{
      .topic = text.substr(0, first), .parent = frame_name(frames.substr(0, second)), .child = {}};
  if (second != std::string_view::npos) spec.child = frame_name(frames.substr(second + 1));
  if (spec.topic.empty() || spec.parent.empty() || spec.child.empty() ||
      spec.child.find(':') != std::string_view::npos || spec.parent == spec.child) {
    return fail(ErrorCode::invalid_input,
                fmt::format("expected a topic, or a topic and two frames as in "
                            "/tf:map:base_link, found {}",
                            quoted(text)),
                SourceLocation{file, 0, 0});
  }
  return spec;
}

/// @param visit  Result<void>(const PoseMessage&, const BagMessage&)
/// @return  as for_each_message
template <class Visit>
Result<std::optional<Error>> for_each_pose(MessageReader& reader, const Topics& topics,
                                           const Visit& visit) {
  return for_each_message(reader, topics, [&](const BagMessage& message) -> Result<void> {
    const Topic& topic = reader.topics()[message.topic];
    const auto poses =
        parse_poses(message.bytes, topic.type, *topic.encoding, {reader.file(), 0, 0});
    if (!poses) return in_message(poses.error(), reader, message);
    for (const PoseMessage& pose : *poses) {
      if (auto done = visit(pose, message); !done) {
        return in_message(std::move(done).error(), reader, message);
      }
    }
    return {};
  });
}

/// @return  whether the pose is later than the last one; otherwise it is left out
bool append(Trajectory& trajectory, double stamp, const Pose& pose) {
  if (!trajectory.empty() && stamp <= trajectory.back().stamp) return false;
  trajectory.push_back({stamp, pose});
  return true;
}

Result<BagTrajectory> read_poses(MessageReader& reader, const Topics& topics) {
  BagTrajectory found;
  bool is_first = true;
  VANTAGE_TRY(const bool has_log_times, lacks_stamps(reader, topics));
  const auto add = [&](const PoseMessage& pose, const BagMessage& message) -> Result<void> {
    const std::string_view frame = frame_name(pose.header.frame), child = frame_name(pose.child);
    if (std::exchange(is_first, false)) {
      found.frame = frame;
      found.child = child;
    }
    if (frame != found.frame || child != found.child) {
      return fail(ErrorCode::corrupt_data,
                  fmt::format("the pose is that of {} in {}, expected that of {} in {} as before",
                              quoted(child), quoted(frame), quoted(std::string_view(found.child)),
                              quoted(std::string_view(found.frame))),
                  SourceLocation{reader.file(), 0, 0});
    }
    const double stamp =
        has_log_times ? seconds_from(message.log_time) : pose.header.stamp.seconds();
    const bool lacks_one = !has_log_times && stamp == 0.0;
    if (!lacks_one && append(found.poses, stamp, pose.pose)) {
      found.variances.push_back(pose.variances);
    } else {
      ++found.skipped;
    }
    return {};
  };
  VANTAGE_TRY(found.damage, for_each_pose(reader, topics, add));
  found.stamp_rule = has_log_times ? kLogTimes : kHeaderStamps;
  return found;
}

/// What is known about one transform.
struct Samples {
  Trajectory poses;              // T_parent_child
  std::optional<Pose> constant;  // from /tf_static
};

struct SampledPath {
  Path path;
  std::map<Edge, Samples> samples;
  std::uint64_t skipped = 0;    // stamped no later than the one before
  std::optional<Error> damage;  // at which they end
};

Result<TransformTree> read_tree(MessageReader& reader, const Topics& topics) {
  TransformTree tree;
  const auto add = [&](const PoseMessage& pose, const BagMessage&) -> Result<void> {
    if (tree.add(frame_name(pose.header.frame), frame_name(pose.child))) return {};
    return fail(ErrorCode::corrupt_data,
                "there are more than 10000 pairs of frames, expected those of one robot",
                SourceLocation{reader.file(), 0, 0});
  };
  VANTAGE_CHECK(for_each_pose(reader, topics, add));
  return tree;
}

/// @param moving  topics whose transforms change over time; those of other topics do not
Result<SampledPath> read_samples(MessageReader& reader, const Topics& topics, const Topics& moving,
                                 Path path) {
  SampledPath sampled;
  sampled.path = std::move(path);
  for (const auto& step : sampled.path) sampled.samples[step.edge];
  const auto add = [&](const PoseMessage& pose, const BagMessage& message) -> Result<void> {
    const auto found =
        sampled.samples.find(Edge{.parent = std::string(frame_name(pose.header.frame)),
                                  .child = std::string(frame_name(pose.child))});
    if (found == sampled.samples.end()) return {};
    if (!pose.problem.empty()) {
      return fail(ErrorCode::corrupt_data, pose.problem, SourceLocation{reader.file(), 0, 0});
    }
    if (std::find(moving.begin(), moving.end(), message.topic) == moving.end()) {
      found->second.constant = pose.pose;
    } else if (!append(found->second.poses, pose.header.stamp, pose.pose)) {
      ++sampled.skipped;
    }
    return {};
  };
  VANTAGE_TRY(sampled.damage, for_each_pose(reader, topics, add));
  return sampled;
}

std::optional<Pose> pose_of(const Samples& samples, double stamp) {
  if (samples.poses.empty()) return samples.constant;
  return pose_at(samples.poses, stamp);
}

/// The product of all steps.
std::optional<Pose> pose_along(const SampledPath& sampled, double stamp) {
  Pose product;
  for (const auto& [edge, is_inverse] : sampled.path) {
    const auto pose = pose_of(sampled.samples.at(edge), stamp);
    if (!pose) return std::nullopt;
    product = product * (is_inverse ? pose->inverse() : *pose);
  }
  return product;
}

Result<Path> find_path(const TransformTree& tree, const TopicSpec& spec, const std::string& file) {
  const auto error = [&](std::string_view problem) {
    return fail(ErrorCode::invalid_input,
                fmt::format("{}; transforms (parent -> child): {}", problem, tree.edges()),
                SourceLocation{file, 0, 0});
  };
  if (spec.child.empty()) {
    return error(fmt::format("name the frames as in {}:map:base_link", spec.topic));
  }
  VANTAGE_TRY(auto path, tree.path(std::string(spec.parent), std::string(spec.child), file));
  if (path) return *std::move(path);
  return error(
      fmt::format("no transforms lead from {} to {}", quoted(spec.child), quoted(spec.parent)));
}

Result<BagTrajectory> read_transforms(MessageReader& reader, const Topics& chosen,
                                      const TopicSpec& spec) {
  Topics topics = find_topics(reader, kStaticTopic, kTransforms), moving;
  for (const std::size_t topic : chosen) {
    if (reader.topics()[topic].name == kStaticTopic) continue;
    topics.push_back(topic);
    moving.push_back(topic);
  }
  VANTAGE_TRY(const auto tree, read_tree(reader, topics));
  VANTAGE_TRY(auto path, find_path(tree, spec, reader.file()));
  VANTAGE_TRY(const auto sampled, read_samples(reader, topics, moving, std::move(path)));
  const auto fastest = std::max_element(
      sampled.samples.begin(), sampled.samples.end(),
      [](const auto& a, const auto& b) { return a.second.poses.size() < b.second.poses.size(); });
  BagTrajectory found;
  found.skipped = sampled.skipped;
  found.damage = sampled.damage;
  for (const StampedPose& sample : fastest->second.poses) {
    const auto pose = pose_along(sampled, sample.stamp);
    if (pose) {
      found.poses.push_back({sample.stamp, *pose});
    } else {
      ++found.skipped;
    }
  }
  found.frame = spec.parent;
  found.child = spec.child;
  found.stamp_rule = fmt::format("stamps are those of the transform {} -> {}",
                                 fastest->first.parent, fastest->first.child);
  return found;
}

}  // namespace

Result<BagTrajectory> read_bag_trajectory(MessageReader& reader, std::string_view topic_spec) {
  const auto error = [&](ErrorCode code, std::string message) {
    return fail(code, std::move(message), SourceLocation{reader.file(), 0, 0});
  };
  VANTAGE_TRY(const auto spec, parse_spec(reader.file(), topic_spec));
  VANTAGE_TRY(const auto topics, choose_topic(reader, spec.topic, poses_needed()));
  const Topic& topic = reader.topics()[topics.front()];
  const bool has_transforms =
      std::find(kTransforms.begin(), kTransforms.end(), topic.type) != kTransforms.end();
  if (!has_transforms && !spec.child.empty()) {
    return error(ErrorCode::invalid_input,
                 fmt::format("topic {} is of type {}, which has no frames to choose from",
                             quoted(spec.topic), topic.type));
  }
  VANTAGE_TRY(auto found,
              has_transforms ? read_transforms(reader, topics, spec) : read_poses(reader, topics));
  found.topic = topic.name;
  if (found.poses.empty()) {
    return error(
        ErrorCode::corrupt_data,
        fmt::format("topic {} has no pose{}{}", quoted(std::string_view(topic.name)),
                    has_transforms ? " that changes, at a stamp at which all transforms "
                                     "between the frames are known"
                                   : "",
                    found.skipped > 0 ? fmt::format(" ({} left out)", found.skipped) : ""));
  }
  return found;
}

Result<std::optional<Pose>> static_transform(MessageReader& reader, std::string_view parent,
                                             std::string_view child) {
  const std::string to(frame_name(parent)), from(frame_name(child));
  if (to == from) return Pose{};
  const Topics topics = find_topics(reader, kStaticTopic, kTransforms);
  if (topics.empty()) return std::nullopt;
  VANTAGE_TRY(const auto tree, read_tree(reader, topics));
  VANTAGE_TRY(auto path, tree.path(to, from, reader.file()));
  if (!path) return std::nullopt;
  VANTAGE_TRY(const auto sampled, read_samples(reader, topics, {}, *std::move(path)));
  return pose_along(sampled, 0.0);
}

}  // namespace vantage::io::ros
