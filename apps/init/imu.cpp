#include "init/imu.hpp"

#include <fmt/format.h>

#include <cmath>
#include <set>
#include <utility>

#include "evaluation/degrees.hpp"
#include "io/ros/message_reader.hpp"
#include "io/ros/messages.hpp"
#include "io/sensor_mount.hpp"
#include "terminal/command_line.hpp"
#include "vantage/io/imu_io.hpp"

namespace vantage::init {
namespace {

/// The topics of inertial samples in the scans' bag; none if they are not in a bag.
Result<std::set<std::string>> imu_topics(const std::filesystem::path& scans) {
  std::set<std::string> topics;
  VANTAGE_TRY(const bool bag, io::ros::is_bag(scans));
  if (!bag) return topics;
  VANTAGE_TRY(const auto reader, io::ros::open_bag(scans));
  for (const io::ros::Topic& topic : reader->topics()) {
    if (topic.type == io::ros::kImu && topic.encoding) topics.insert(topic.name);
  }
  return topics;
}

/// The mount that is known: none if the frames have no names, or nothing connects them.
struct Mount {
  std::optional<Pose> T_sensor_imu;
  std::string why;
};
Mount mount_of(const io::ImuRecording& imu, const InputOptions& options,
               const std::string& sensor) {
  if (imu.frame.empty() || sensor.empty()) {
    return {{}, "The recording does not say where the IMU is on the sensor"};
  }
  if (imu.frame == sensor) {
    return {Pose{}, fmt::format("The IMU and the scans have one frame, {}", sensor)};
  }
  const io::SensorFrame frame{.name = sensor, .scans = options.scans, .T_child_sensor = {}};
  const auto T_imu_sensor = io::sensor_mount("samples of the IMU", imu.frame, options.scans, frame);
  if (!T_imu_sensor || !*T_imu_sensor) {
    return {{}, fmt::format("No /tf_static connects {} with {}", imu.frame, sensor)};
  }
  return {(*T_imu_sensor)->inverse(),
          fmt::format("/tf_static connects {} with {}", imu.frame, sensor)};
}

}  // namespace

bool agrees_with_ground(const Eigen::Vector3d& down, const checks::ScanFacts& scans) {
  constexpr double kOff = 20.0;  // [deg]
  if (!scans.below && !scans.above) return true;
  const bool below = scans.below && (!scans.above || scans.below->share >= scans.above->share);
  const double up = below ? -down.z() : down.z();
  const double tilt = (below ? scans.below : scans.above)->tilt;
  return std::acos(std::clamp(up, -1.0, 1.0)) < tilt + kOff / kDegrees;
}

Result<ImuChoice> choose_imu(const InputOptions& options, RunInputs& inputs,
                             const checks::ScanFacts& scans, double first) {
  ImuChoice choice;
  UsableImu imu{.option = options.imu,
                .topic = options.imu_topic,
                .T_sensor_imu = {},
                .why = {},
                .description = {}};
  if (!inputs.imu) {
    VANTAGE_TRY(const auto topics, imu_topics(options.scans));
    if (topics.empty()) return choice;
    if (topics.size() > 1) {
      choice.remarks.push_back(
          fmt::format("The recording has {} topics of an IMU ({}): choose one with --imu.",
                      topics.size(), fmt::join(topics, ", ")));
      return choice;
    }
    imu.option = *topics.begin();
    auto recording = io::read_imu({.path = options.scans, .topic = imu.option});
    if (!recording) {
      choice.remarks.push_back(
          fmt::format("The IMU of {} is not used: {}.", imu.option, recording.error().message));
      return choice;
    }
    inputs.imu = *std::move(recording);
    add_damage(inputs, inputs.imu->damage);
  }
  const io::ImuRecording& recording = *inputs.imu;
  const auto refuse = [&](std::string why) {
    choice.remarks.push_back(std::move(why));
    inputs.imu.reset();
    return choice;
  };
  const double begin = recording.samples.front().stamp, end = recording.samples.back().stamp;
  if (first < begin - 1.0 || first > end) {
    return refuse(
        fmt::format("The IMU of {} is not used: its samples are stamped {:.3f} to {:.3f} "
                    "s, and the first scan {:.3f} s.",
                    imu.option, begin, end, first));
  }
  Mount mount = mount_of(recording, options, inputs.opened->describe().frame);
  imu.T_sensor_imu = mount.T_sensor_imu.value_or(Pose{});
  imu.why = mount.why;
  imu.description =
      fmt::format("{:.0f} Hz, accelerations in {}", recording.rate_hz, to_string(recording.unit));
  if (recording.rest) {
    const Eigen::Vector3d down =
        imu.T_sensor_imu.rotation.toRotationMatrix() * recording.rest->gravity;
    if (!agrees_with_ground(down, scans)) {
      return refuse(fmt::format(
          "The IMU of {} is not used: {}, and at rest its gravity does not point to the ground of "
          "the scans, as if both had the same axes. State localizer.T_sensor_imu, and add --imu.",
          imu.option, mount.why));
    }
    if (!mount.T_sensor_imu) imu.why += ". At rest, its gravity points to the ground of the scans";
  }
  if (!mount.T_sensor_imu) {
    imu.why += ". YOURS: this value takes its axes for those of the LiDAR";
  }
  choice.imu = std::move(imu);
  return choice;
}

}  // namespace vantage::init
