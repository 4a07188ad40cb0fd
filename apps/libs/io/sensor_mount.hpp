#pragma once

#include <filesystem>
#include <optional>
#include <string>
#include <string_view>

#include "vantage/io/sensor_trajectory.hpp"
#include "vantage/pose.hpp"
#include "vantage/result.hpp"

namespace vantage::io {

/// T_child_sensor: the user's, else that of /tf_static in the bag, else in the scans' bag. Nothing
/// if `child` is the sensor, or if one of the two names is unknown and the user says nothing.
/// @param what   whose frame is `child`, for errors: "poses of /odom"
/// @param child  a frame without a leading slash
/// Errors: `invalid_input` if nothing connects the frames; those of ros::static_transform.
[[nodiscard]] Result<std::optional<Pose>> sensor_mount(std::string_view what,
                                                       std::string_view child,
                                                       const std::filesystem::path& bag,
                                                       const SensorFrame& sensor);

}  // namespace vantage::io
