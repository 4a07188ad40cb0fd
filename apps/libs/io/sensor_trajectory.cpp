#include "vantage/io/sensor_trajectory.hpp"

#include <utility>

#include "io/ros/bag_trajectory.hpp"
#include "io/ros/message_reader.hpp"
#include "io/sensor_mount.hpp"

namespace vantage::io {

Result<SensorTrajectory> read_sensor_trajectory(const TrajectorySource& source,
                                                const SensorFrame& sensor) {
  VANTAGE_TRY(const bool bag, ros::is_bag(source.path));
  if (!bag && !source.topic.empty()) {
    return fail(ErrorCode::invalid_input,
                "a text file with poses has no topics, so none can be chosen",
                SourceLocation{source.path.string(), 0, 0});
  }
  if (!bag) {
    VANTAGE_TRY(auto poses, read_trajectory(source.path, source.rate_hz));
    return SensorTrajectory{.poses = std::move(poses)};
  }
  VANTAGE_TRY(const auto reader, ros::open_bag(source.path));
  VANTAGE_TRY(auto found, ros::read_bag_trajectory(*reader, source.topic));
  VANTAGE_TRY(const auto T_child_sensor,
              sensor_mount("poses of " + found.topic, found.child, source.path, sensor));
  for (StampedPose& moment : found.poses) {
    if (T_child_sensor) moment.pose = moment.pose * *T_child_sensor;
  }
  return SensorTrajectory{.poses = std::move(found.poses), .damage = std::move(found.damage)};
}

}  // namespace vantage::io
