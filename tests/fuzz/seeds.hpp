#pragma once

#include <string>
#include <vector>

namespace vantage::test::seeds {

// Small sound inputs, by the project's own writers.
[[nodiscard]] std::vector<std::string> pcd();
[[nodiscard]] std::vector<std::string> ply();
[[nodiscard]] std::vector<std::string> las();
[[nodiscard]] std::vector<std::string> rosbag1();
[[nodiscard]] std::vector<std::string> rosbag2();
[[nodiscard]] std::vector<std::string> mcap();
/// Messages after one byte: 0 for ROS 1, 1 for CDR.
[[nodiscard]] std::vector<std::string> point_cloud2();
/// Messages after two bytes: 0 for ROS 1 or 1 for CDR, and the index into test::kPoseTypes.
[[nodiscard]] std::vector<std::string> poses();
/// Messages after one byte: 0 for ROS 1, 1 for CDR.
[[nodiscard]] std::vector<std::string> nav_sat_fix();
[[nodiscard]] std::vector<std::string> livox();
[[nodiscard]] std::vector<std::string> imu();
[[nodiscard]] std::vector<std::string> imu_csv();
[[nodiscard]] std::vector<std::string> velodyne();
[[nodiscard]] std::vector<std::string> trajectory();
[[nodiscard]] std::vector<std::string> tiles();
[[nodiscard]] std::vector<std::string> map_projector();
/// An index of places, as a store keeps it.
[[nodiscard]] std::vector<std::string> places();

}  // namespace vantage::test::seeds
