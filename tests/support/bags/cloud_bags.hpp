#pragma once

#include <array>
#include <cstdint>
#include <string>
#include <vector>

#include "support/bags/message_writer.hpp"

namespace vantage::test {

/// A scan to write.
struct FloatScan {
  std::int64_t stamp = 0;  ///< [ns]
  std::vector<std::array<float, 3>> points;
};

enum class PointLayout {
  packed,  ///< x, y, z, intensity in 16 bytes
  padded   ///< as PCL has them: x, y, z, 4 bytes of nothing, intensity, ring, to 32 bytes
};

/// A sensor_msgs/PointCloud2.
[[nodiscard]] std::string point_cloud2(const FloatScan& scan, MessageWriter::Layout message,
                                       PointLayout point);

/// A way to write scans into a bag, on topic /points.
struct CloudBag {
  std::string name;    ///< "rosbag1_bz2"
  std::string format;  ///< as its reader calls it
  std::string (*write)(const std::vector<FloatScan>& scans, PointLayout layout);
};

/// Every container and compression: rosbag1, rosbag2 and MCAP.
[[nodiscard]] std::vector<CloudBag> cloud_bags();

}  // namespace vantage::test
