#include "io/sensor_mount.hpp"

#include <fmt/format.h>

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

}  // namespace

Result<std::optional<Pose>> sensor_mount(std::string_view what, std::string_view child,
                                         const std::filesystem::path& bag,
                                         const SensorFrame& sensor) {
  const std::string_view name = ros::frame_name(sensor.name);
  if (sensor.T_child_sensor && (child.empty() || child != name)) return sensor.T_child_sensor;
  if (child.empty() || name.empty() || child == name) return std::nullopt;
  for (const auto& path : {bag, sensor.scans}) {
    if (path.empty()) continue;
    VANTAGE_TRY(const auto transform, static_transform_in(path, child, name));
    if (transform) return transform;
  }
  return fail(ErrorCode::invalid_input,
              fmt::format("the {} are those of frame {}, the scans are in frame {}, and no "
                          "/tf_static connects them; say with --mount where the sensor is",
                          what, quoted(child), quoted(name)),
              SourceLocation{bag.string(), 0, 0});
}

}  // namespace vantage::io
