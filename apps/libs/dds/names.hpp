#pragma once

#include <string>
#include <string_view>

#include "vantage/result.hpp"

namespace vantage::dds {

/// How ROS 2 names a type on the wire: "sensor_msgs::msg::dds_::PointCloud2_" for
/// "sensor_msgs/PointCloud2".
/// @param kind  "msg" or "srv"
/// @param part  of a service: "_Request" or "_Response"
[[nodiscard]] std::string name_of_type(std::string_view type, std::string_view kind = "msg",
                                       std::string_view part = "");
/// The other way round: "sensor_msgs/PointCloud2". A name that is not ROS 2's stays as it is.
[[nodiscard]] std::string type_of_name(std::string_view name);
/// "rt/points" for "/points".
[[nodiscard]] std::string name_of_topic(std::string_view topic);
/// Errors: `invalid_input` for a name that is no topic or service.
[[nodiscard]] Result<void> check_name(std::string_view name);

}  // namespace vantage::dds
