#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <span>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "io/ros/messages.hpp"
#include "vantage/point_cloud.hpp"
#include "vantage/pose.hpp"
#include "vantage/result.hpp"
#include "vantage/track/rotation.hpp"

namespace vantage::io::ros {

/// One number of every point beside x, y and z.
struct CloudField {
  std::string name;
  std::span<const float> values;  ///< as many as there are points; borrowed
};

/// How x, y and z of a cloud are encoded. RViz and PCL read float32 only.
enum class Coordinates : std::uint8_t { float32, float64 };
/// float32, unless it would move a coordinate by more than 1 mm, as it does far from the origin.
[[nodiscard]] Coordinates coordinates_for(PointsView points);

/// diagnostic_msgs/DiagnosticStatus.
struct Diagnostic {
  enum class Level : std::uint8_t { ok = 0, warn = 1, error = 2, stale = 3 };
  Level level = Level::ok;
  std::string name, message;
  std::vector<std::pair<std::string, std::string>> values;
};

/// Functions that encode messages as ROS 2 does (CDR, little endian; see schema_of for their
/// types).
/// Errors: `invalid_input` for stamps that are not valid times (see time_of), and for messages of
/// 2^32 bytes or more.

/// sensor_msgs/PointCloud2 with x, y, z [m], and the other fields as float32; not dense if a
/// coordinate is beyond float32, which is then written as NaN. Errors: also `invalid_input` for a
/// field that does not have one value per point.
[[nodiscard]] Result<std::string> write_point_cloud2(
    const Header& header, PointsView points, std::span<const CloudField> more = {},
    Coordinates coordinates = Coordinates::float32);
/// geometry_msgs/PoseStamped.
[[nodiscard]] Result<std::string> write_pose_stamped(const Header& header, const Pose& pose);
/// Of x, y, z [m] and of the rotation about the fixed axes [rad].
using PoseCovariance = Eigen::Matrix<double, 6, 6, Eigen::DontAlign>;
/// geometry_msgs/PoseWithCovarianceStamped.
[[nodiscard]] Result<std::string> write_pose_with_covariance(const Header& header, const Pose& pose,
                                                             const PoseCovariance& covariance);
/// nav_msgs/Odometry. @param twist  of the child, in its frame [m/s, rad/s]; its covariance is 0
[[nodiscard]] Result<std::string> write_odometry(
    const Header& header, std::string_view child, const Pose& T_frame_child,
    const PoseCovariance& covariance = PoseCovariance::Zero(), const Twist& twist = {});
/// sensor_msgs/Imu without an orientation, which its covariance says.
[[nodiscard]] Result<std::string> write_imu(const Header& header,
                                            const Eigen::Vector3d& angular_velocity,
                                            const Eigen::Vector3d& linear_acceleration);
/// The answer of std_srvs/SetBool.
[[nodiscard]] Result<std::string> write_set_bool_answer(bool success, std::string_view message);
/// The answer of Autoware's service PoseWithCovarianceStamped.
/// @param reliable  whether the pose is good enough to drive from
[[nodiscard]] Result<std::string> write_align_answer(bool success, bool reliable,
                                                     const Header& header, const Pose& pose,
                                                     const PoseCovariance& covariance);
/// std_msgs/String.
[[nodiscard]] Result<std::string> write_string(std::string_view text);
/// tf2_msgs/TFMessage.
[[nodiscard]] Result<std::string> write_transforms(std::span<const PoseMessage> transforms);
/// diagnostic_msgs/DiagnosticArray.
[[nodiscard]] Result<std::string> write_diagnostics(const Header& header,
                                                    std::span<const Diagnostic> diagnostics);

}  // namespace vantage::io::ros
