#pragma once

#include <string>
#include <string_view>

#include "vantage/result.hpp"

namespace vantage::foxglove {

/// Encodings in which a client may publish; the first that it knows is the one it takes.
inline constexpr std::string_view kCdr = "cdr", kJson = "json";

/// Whether a client may publish a pose of this type: geometry_msgs/PoseWithCovarianceStamped or
/// geometry_msgs/PoseStamped, in the spelling of ROS 1 or 2.
[[nodiscard]] bool is_pose(std::string_view type) noexcept;

/// The message that a ROS 2 node would get: CDR of geometry_msgs/PoseWithCovarianceStamped. A
/// PoseStamped gets the variances that RViz gives a pose: a hand points to a place on a screen.
/// @param type      see is_pose
/// @param encoding  kCdr or kJson
/// @param bytes     the message; in JSON a time is `sec` and `nsec` or `nanosec`
/// Errors: `corrupt_data` for bytes that are no such message, and for a pose that is no rigid
/// transform; `unsupported` for another type or encoding.
[[nodiscard]] Result<std::string> given_pose(std::string_view type, std::string_view encoding,
                                             std::string_view bytes);

}  // namespace vantage::foxglove
