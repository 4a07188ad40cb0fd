#pragma once

#include <Eigen/Core>
#include <array>
#include <cstdint>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "io/map_projection.hpp"
#include "io/ros/message_reader.hpp"
#include "io/ros/ros_time.hpp"
#include "vantage/io/point_cloud_io.hpp"
#include "vantage/pose.hpp"
#include "vantage/result.hpp"

namespace vantage::io::ros {

/// std_msgs/Header.
struct Header {
  Stamp stamp;
  std::string frame;
};

/// sensor_msgs/PointCloud2 or one of kLivoxMessages: its finite points in their order, row
/// by row.
struct CloudMessage {
  Header header;
  LoadedCloud cloud;                ///< with the times of PointTimes, if a field holds them, and
                                    ///< with tags, if a field `tag` of uint8 does
  std::vector<std::string> fields;  ///< "x float32"
  std::uint32_t width = 0, height = 0;
};

inline constexpr std::string_view kPointCloud2 = "sensor_msgs/PointCloud2";
/// All drivers send the same message; the second name is that of livox_ros2_driver.
inline constexpr std::array<std::string_view, 3> kLivoxMessages{
    "livox_ros_driver/CustomMsg", "livox_interfaces/CustomMsg", "livox_ros_driver2/CustomMsg"};

struct VelodynePacket {
  double stamp = 0.0;     ///< [s]
  std::string_view data;  ///< 1206 bytes, in the message
};

/// velodyne_msgs/VelodyneScan.
struct VelodyneScanMessage {
  Header header;
  std::vector<VelodynePacket> packets;
};

/// The variances that a message states, as they were sent.
struct PoseVariances {
  std::array<double, 3> translation{};  ///< along x, y and z of the frame [m^2]
  double heading = 0.0;                 ///< about the frame's z [rad^2]
};

/// T_frame_child of nav_msgs/Odometry, geometry_msgs/PoseStamped (and ...WithCovarianceStamped; no
/// child) or a member of tf2_msgs/TFMessage.
struct PoseMessage {
  Header header;
  std::string child;
  Pose pose;  ///< its quaternion normalized if it was within 1e-3 of unit length
  /// For a member of a TFMessage whose pose is invalid, the reason; `pose` is then the identity. A
  /// wheel without an angle must not hide the other transforms.
  std::string problem = {};
  std::optional<PoseVariances> variances = {};  ///< of types with a covariance
};

inline constexpr std::string_view kNavSatFix = "sensor_msgs/NavSatFix";

/// sensor_msgs/NavSatFix.
struct FixMessage {
  Header header;
  bool has_fix = false;
  GeoPosition position;                            ///< may be NaN
  std::optional<std::array<double, 3>> variances;  ///< east, north, up [m^2], unless unknown
};

inline constexpr std::string_view kImu = "sensor_msgs/Imu";

/// sensor_msgs/Imu, without its orientation.
struct ImuMessage {
  Header header;
  Eigen::Vector3d angular_velocity = Eigen::Vector3d::Zero();     ///< may be NaN
  Eigen::Vector3d linear_acceleration = Eigen::Vector3d::Zero();  ///< may be NaN
  bool is_measured = true;  ///< false if a covariance says that one of both is not
};

/// A time of ROS [ns since the epoch] as seconds, rounded like the stamps of headers.
[[nodiscard]] double seconds_from(std::int64_t nanoseconds) noexcept;

/// Functions that decode messages. `where` names the message in errors.
/// Errors: `corrupt_data` with the byte in the message and what was expected: an early end, sizes
/// that contradict each other, a field of unknown type, a missing x, y or z, a number in a pose
/// that is not finite, an invalid rotation (but see PoseMessage::problem). Memory for a count is
/// allocated only after the counted bytes are known to exist.
[[nodiscard]] Result<CloudMessage> parse_point_cloud2(std::string_view bytes, Encoding encoding,
                                                      const SourceLocation& where);
/// `offset_time` of a point counts from `timebase`, which the drivers also send as the header's
/// stamp. It is negative if packets come in the wrong order, see PointTimes.
[[nodiscard]] Result<CloudMessage> parse_livox(std::string_view bytes, Encoding encoding,
                                               const SourceLocation& where);
/// The packets are views into `bytes`.
[[nodiscard]] Result<VelodyneScanMessage> parse_velodyne_scan(std::string_view bytes,
                                                              Encoding encoding,
                                                              const SourceLocation& where);
/// Of any message that begins with a header; the rest is not read.
[[nodiscard]] Result<Header> parse_header(std::string_view bytes, Encoding encoding,
                                          const SourceLocation& where);
/// Of nav_msgs/Odometry, geometry_msgs/PoseStamped, geometry_msgs/PoseWithCovarianceStamped,
/// geometry_msgs/TransformStamped (one each), tf2_msgs/TFMessage and tf/tfMessage (any number).
/// @param type  in ROS 1's spelling
[[nodiscard]] Result<std::vector<PoseMessage>> parse_poses(std::string_view bytes,
                                                           std::string_view type, Encoding encoding,
                                                           const SourceLocation& where);
[[nodiscard]] Result<FixMessage> parse_nav_sat_fix(std::string_view bytes, Encoding encoding,
                                                   const SourceLocation& where);
[[nodiscard]] Result<ImuMessage> parse_imu(std::string_view bytes, Encoding encoding,
                                           const SourceLocation& where);
/// The request of std_srvs/SetBool.
[[nodiscard]] Result<bool> parse_set_bool(std::string_view bytes, Encoding encoding,
                                          const SourceLocation& where);
/// Whether parse_poses knows the type.
[[nodiscard]] bool has_poses(std::string_view type) noexcept;

}  // namespace vantage::io::ros
