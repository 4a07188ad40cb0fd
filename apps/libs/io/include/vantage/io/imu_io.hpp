#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <filesystem>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "vantage/result.hpp"
#include "vantage/track/samples.hpp"

namespace vantage::io {

/// Where inertial samples come from.
struct ImuSource {
  std::filesystem::path path;  ///< a bag, a CSV file or KITTI's folder oxts
  std::string topic = {};      ///< of sensor_msgs/Imu; empty for the bag's only one
  /// Of KITTI's oxts: frame k gets the stamp k / frame_rate_hz, like scans and poses of files
  /// without stamps. If left out, timestamps.txt has the stamps.
  std::optional<double> frame_rate_hz = {};
};

/// The unit in which a source gives accelerations.
enum class ForceUnit : std::uint8_t { metres_per_second_squared, standard_gravity };
/// "m/s^2" or "g".
[[nodiscard]] std::string_view to_string(ForceUnit unit) noexcept;

/// What a recording that begins at rest says about its sensor. A sensor that moves evenly along a
/// straight line cannot be told from one at rest.
struct ImuRest {
  double seconds = 0.0;                                 ///< how long it is at rest, at most 10 s
  Eigen::Vector3d gyro_bias = Eigen::Vector3d::Zero();  ///< mean angular velocity [rad/s]
  Eigen::Vector3d gravity = Eigen::Vector3d::Zero();    ///< direction, down; length 1, IMU frame
  double force = 0.0;                                   ///< length of the mean force [m/s^2]
};

struct ImuRecording {
  std::vector<ImuSample> samples;  ///< at least one; stamps increase strictly
  std::string source;              ///< the path and the topic, for messages
  std::string topic;               ///< empty if there are no topics
  std::string frame;               ///< frame_id of the messages without a leading slash, or empty
  std::string stamp_rule;          ///< a sentence that says where the stamps come from
  ForceUnit unit = ForceUnit::metres_per_second_squared;  ///< of the source
  double still_force = 0.0;  ///< mean norm of the force in the stillest second, in `unit`
  double rate_hz = 0.0;  ///< 1 / the mean interval, without pauses of more than twice the median
                         ///< one; 0 for a single sample
  std::optional<ImuRest> rest = {};
  /// Samples left out: a NaN, an infinite number, a quantity that the message says it does not
  /// measure, or no stamp.
  std::uint64_t not_finite = 0;
  std::uint64_t duplicates = 0;    ///< samples left out, because one before has the same stamp
  std::uint64_t out_of_order = 0;  ///< samples that came after a later one; they are sorted in
  /// At which a bag that is cut off or damaged ends; the samples are those before.
  std::optional<Error> damage = {};
};

/// Reads angular velocities and accelerations.
/// - a bag: sensor_msgs/Imu. Stamps are those of the headers, or log times if the first header has
///   none (0). Orientations are not looked at.
/// - CSV: the first line names the columns. `t,wx,wy,wz,ax,ay,az` [s, rad/s, m/s^2 or g], or
///   EuRoC's `#timestamp [ns],w_RS_S_x [rad s^-1],...,a_RS_S_x [m s^-2],...`, in any order; other
///   columns are not read.
/// - KITTI's folder oxts: ax, ay, az, wx, wy, wz of data/NNNNNNNNNN.txt. Stamps are those of
///   timestamps.txt, as if they were in UTC, or see ImuSource::frame_rate_hz.
/// The unit of acceleration is found in the second in which the sensor moves least: a mean norm of
/// 0.8 to 1.2 is in g, one of 7 to 12 in m/s^2. `samples` are in m/s^2 in either case.
/// Errors (`where` is the file and, in text, the line): `not_found`; `io_failure`; `invalid_input`
/// with a list, for a topic that does not exist, is of another type or must be chosen, and for a
/// topic or a frame rate that the format does not have; `corrupt_data` for malformed content, a
/// frame that changes, no usable sample, and another norm.
[[nodiscard]] Result<ImuRecording> read_imu(const ImuSource& source);

/// Whether a path is a CSV file or a folder that read_imu reads, judged by the content.
[[nodiscard]] bool is_imu(const std::filesystem::path& path);

}  // namespace vantage::io
