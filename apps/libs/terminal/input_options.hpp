#pragma once

#include <CLI/CLI.hpp>
#include <filesystem>
#include <string>

#include "vantage/evaluation/run.hpp"
#include "vantage/result.hpp"

namespace vantage {

/// The help of options that several programs share.
inline constexpr const char* kPoseTopicHelp =
    "its topic, where a bag has several; of transforms with frames: /tf:map:base_link";
inline constexpr const char* kMountHelp =
    "pose of the sensor in the frame whose poses a bag has, x,y,z,roll,pitch,yaw [m, rad], where "
    "no /tf_static says it";

/// The options that select the inputs of a run.
struct InputOptions {
  std::filesystem::path scans = {}, reference = {}, odometry = {};  ///< an empty path means none
  std::string topic = {};                                 ///< of the scans, if a bag has several
  std::string reference_topic = {}, odometry_topic = {};  ///< of bags, see io::TrajectorySource
  std::string mount = {};  ///< --mount: x,y,z,roll,pitch,yaw, or empty
  TimeWindow window = {};
  double rate_hz = 10.0;

  void add_to(CLI::App& app, bool reference_required);
  [[nodiscard]] Result<RunInputs> open() const;
};

}  // namespace vantage
