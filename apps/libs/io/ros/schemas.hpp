#pragma once

#include <string>
#include <string_view>

#include "vantage/result.hpp"

namespace vantage::io::ros {

/// The description of a message type in an MCAP file of ROS 2 ("ros2msg").
struct MessageSchema {
  std::string name;  ///< "sensor_msgs/msg/PointCloud2"
  std::string text;  ///< its definition and those of all types in it (MCAP registry, "ros2msg")

  friend bool operator==(const MessageSchema&, const MessageSchema&) = default;
};

/// For the types that Vantage reads or writes.
/// @param type  in ROS 1's spelling: "sensor_msgs/PointCloud2"
/// Errors: `invalid_input` for any other type.
[[nodiscard]] Result<MessageSchema> schema_of(std::string_view type);

/// For the services that Vantage answers: a type whose members are the request, the response and
/// the event, as REP-2011 describes a service.
/// @param type  "std_srvs/SetBool"; the schema's name is "std_srvs/srv/SetBool"
/// Errors: `invalid_input` for any other type.
[[nodiscard]] Result<MessageSchema> service_schema_of(std::string_view type);

}  // namespace vantage::io::ros
