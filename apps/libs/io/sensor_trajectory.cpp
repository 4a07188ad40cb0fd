#include "vantage/io/sensor_trajectory.hpp"

#include <fmt/format.h>

#include <string_view>
#include <utility>

#include "io/ros/bag_trajectory.hpp"
#include "io/ros/message_reader.hpp"
#include "io/ros/transform_tree.hpp"
#include "io/text.hpp"

namespace vantage::io {
namespace {

Result<std::optional<Pose>> static_transform_in(const std::filesystem::path& path,
                                                std::string_view parent, std::string_view child) {
  VANTAGE_TRY(const bool bag, ros::is_bag(path));
  if (!bag) return std::optional<Pose>();
  VANTAGE_TRY(const auto reader, ros::open_bag(path));
  return ros::static_transform(*reader, parent, child);
}

Result<Pose> mount(const ros::BagTrajectory& found, const TrajectorySource& source,
                   const SensorFrame& sensor) {
  if (sensor.T_child_sensor) return *sensor.T_child_sensor;
  const std::string_view name = ros::frame_name(sensor.name);
  for (const auto& path : {source.path, sensor.scans}) {
    if (path.empty()) continue;
    VANTAGE_TRY(const auto transform, static_transform_in(path, found.child, name));
    if (transform) return *transform;
  }
  return fail(ErrorCode::invalid_input,
              fmt::format("the poses of {} are those of frame {}, the scans are in frame {}, and "
                          "no /tf_static connects them; say with --mount where the sensor is",
                          found.topic, io::quoted(found.child), io::quoted(name)),
              SourceLocation{source.path.string(), 0, 0});
}

}  // namespace

Result<Trajectory> read_sensor_trajectory(const TrajectorySource& source,
                                          const SensorFrame& sensor) {
  VANTAGE_TRY(const bool bag, ros::is_bag(source.path));
  if (!bag && !source.topic.empty()) {
    return fail(ErrorCode::invalid_input,
                "a text file with poses has no topics, so none can be chosen",
                SourceLocation{source.path.string(), 0, 0});
  }
  if (!bag) return read_trajectory(source.path, source.rate_hz);
  VANTAGE_TRY(const auto reader, ros::open_bag(source.path));
  VANTAGE_TRY(auto found, ros::read_bag_trajectory(*reader, source.topic));
  const bool is_sensor =
      found.child.empty() || sensor.name.empty() || found.child == ros::frame_name(sensor.name);
  if (is_sensor) return std::move(found.poses);
  VANTAGE_TRY(const Pose T_child_sensor, mount(found, source, sensor));
  for (StampedPose& moment : found.poses) moment.pose = moment.pose * T_child_sensor;
  return std::move(found.poses);
}

}  // namespace vantage::io
