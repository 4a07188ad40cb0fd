#pragma once

#include <CLI/CLI.hpp>
#include <filesystem>
#include <string>

#include "vantage/evaluation/run.hpp"
#include "vantage/result.hpp"

namespace vantage {

/// The help of options that several programs share.
inline constexpr const char* kPoseTopicHelp =
    "its topic, if a bag has several; for transforms, with frames: /tf:map:base_link";
inline constexpr const char* kMountHelp =
    "pose of the sensor in the frame of the bag's poses, x,y,z,roll,pitch,yaw [m, rad], if no "
    "/tf_static contains it";

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
