#pragma once

#include <cstddef>
#include <memory>
#include <vector>

#include "io/ros/message_reader.hpp"
#include "vantage/io/scan_source.hpp"
#include "vantage/result.hpp"

namespace vantage::io::ros {

/// The revolutions of the sensor whose packets velodyne_msgs/VelodyneScan messages contain. They
/// are cut anew (see velodyne::SpinAssembler), wherever the messages begin and end.
/// @param topics  indices into topics() of one name and that type
/// Errors: those of MessageReader, parse_velodyne_scan and velodyne::describe_packets;
/// `corrupt_data` for a bag without a packet.
[[nodiscard]] Result<std::unique_ptr<ScanSource>> packet_scans(
    std::unique_ptr<MessageReader> reader, const std::vector<std::size_t>& topics);

}  // namespace vantage::io::ros
