#pragma once

#include <memory>
#include <string>

#include "io/ros/message_reader.hpp"
#include "vantage/io/scan_source.hpp"
#include "vantage/result.hpp"

namespace vantage::io::ros {

/// The scans of one topic of a bag. Of sensor_msgs/PointCloud2 one message is one scan; stamps are
/// those of the headers, or the log times if the first header has none (0). For
/// velodyne_msgs/VelodyneScan see packet_scans.
/// @param topic  empty for the only one of type PointCloud2, or the only VelodyneScan if there is
///               no PointCloud2
/// Errors (`where` is the file): `invalid_input` with a list of the topics, for one that is not
/// there or does not hold scans, or that must be chosen; those of MessageReader and, of the first
/// message, parse_point_cloud2 and parse_velodyne_scan.
[[nodiscard]] Result<std::unique_ptr<ScanSource>> bag_scans(std::unique_ptr<MessageReader> reader,
                                                            const std::string& topic);

}  // namespace vantage::io::ros
