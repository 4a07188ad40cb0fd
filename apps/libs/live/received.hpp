#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "dds/participant.hpp"
#include "live/live_params.hpp"

namespace vantage::live {

/// What a session listens to.
enum class Input : std::uint8_t {
  points,
  imu,
  odometry,
  initial_pose,
  prior,
  fix,
  followed_pose,
  static_transforms,
  transforms,  ///< of other nodes, to tell of frames that both publish
  align,       ///< a request: look for the vehicle around a pose
  trigger      ///< a request: localize, or leave scans out
};

/// A message as it came.
struct Received {
  Input input = Input::points;
  std::int64_t arrival = 0;                    ///< by a clock that nobody sets [ns]
  std::int64_t time = 0;                       ///< of day, for recordings [ns since the epoch]
  std::string message;                         ///< CDR with its header
  std::optional<dds::RequestId> request = {};  ///< of `align` and `trigger`
};

/// Its key in [live.topics] or [live.services]: "initial_pose".
[[nodiscard]] std::string_view name_of(Input input);

/// The topic of an input.
struct InputTopic {
  Input input;
  dds::Topic topic;
};

/// What a configuration listens to, /tf and /tf_static included; with a `followed_pose`, poses
/// alone.
[[nodiscard]] std::vector<InputTopic> input_topics(const TopicParams& topics);

/// The service of an input.
struct InputService {
  Input input;
  dds::Service service;
};

/// What a configuration answers.
[[nodiscard]] std::vector<InputService> input_services(const ServiceParams& services);

}  // namespace vantage::live
