#pragma once

#include <cstddef>
#include <string_view>
#include <vector>

#include "io/raw_imu.hpp"
#include "io/ros/message_reader.hpp"
#include "io/ros/topic_choice.hpp"
#include "vantage/result.hpp"

namespace vantage::io::ros {

/// Topics of sensor_msgs/Imu.
[[nodiscard]] TopicNeed imu_needed();

/// Reads all messages of topics of sensor_msgs/Imu; selects other topics.
/// @param topics  indices into topics() of one name
/// Errors (`where` is the file): `corrupt_data` for a frame that changes; those of MessageReader
/// and parse_imu.
[[nodiscard]] Result<RawImu> read_bag_imu(MessageReader& reader,
                                          const std::vector<std::size_t>& topics);

}  // namespace vantage::io::ros
