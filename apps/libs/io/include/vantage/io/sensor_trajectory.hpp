#pragma once

#include <filesystem>
#include <optional>
#include <string>

#include "vantage/io/trajectory_io.hpp"
#include "vantage/pose.hpp"
#include "vantage/result.hpp"

namespace vantage::io {

/// Where a trajectory of the sensor comes from.
struct TrajectorySource {
  std::filesystem::path path;  ///< a text file, see read_trajectory, or a ROS bag
  std::string topic;           ///< in a bag with several topics, see ros::read_bag_trajectory
  double rate_hz = 10.0;       ///< of KITTI rows
};

/// The sensor whose poses are wanted.
struct SensorFrame {
  std::string name;                         ///< frame_id of its scans; empty if they do not say
  std::filesystem::path scans = {};         ///< a bag that may also have /tf_static
  std::optional<Pose> T_child_sensor = {};  ///< the sensor's mount, if no /tf_static gives it
};

/// Where the sensor was: T_frame_sensor at each stamp.
struct SensorTrajectory {
  Trajectory poses;
  /// At which a bag that is cut off or damaged ends; the poses are those before.
  std::optional<Error> damage = {};
};

/// Reads where the sensor was. Poses in text files, and poses without a child frame, are
/// taken as those of the sensor. A bag's poses of another frame are carried to the sensor by
/// `T_child_sensor`; without it, by /tf_static of that bag, or else of the scans' bag.
/// Errors: those of read_trajectory and ros::read_bag_trajectory; `invalid_input` for a topic of a
/// text file, and for poses of another frame that nothing connects with the sensor's.
[[nodiscard]] Result<SensorTrajectory> read_sensor_trajectory(const TrajectorySource& source,
                                                              const SensorFrame& sensor);

}  // namespace vantage::io
