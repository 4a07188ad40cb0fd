#pragma once

#include <memory>
#include <string>

#include "io/ros/message_reader.hpp"
#include "vantage/io/scan_source.hpp"
#include "vantage/result.hpp"

namespace vantage::io::ros {

/// The scans of one topic of a bag. Each message of type sensor_msgs/PointCloud2 or
/// livox_ros_driver(2)/CustomMsg is one scan; stamps are those of the headers, or the log times if
/// the first header has none (0). For velodyne_msgs/VelodyneScan, see packet_scans.
/// @param options  its topic is empty for the only topic with one of the first types, or for the
///                 only VelodyneScan if there is none; its path only appears in errors
/// Errors (`where` is the file): `invalid_input` with a list of the topics, for a topic that does
/// not exist, does not hold scans, or must be chosen, and for options that the messages cannot
/// serve (see open_scans); those of MessageReader; those of parse_point_cloud2, parse_livox and
/// parse_velodyne_scan for the first message.
[[nodiscard]] Result<std::unique_ptr<ScanSource>> bag_scans(std::unique_ptr<MessageReader> reader,
                                                            const ScanOptions& options);

}  // namespace vantage::io::ros
