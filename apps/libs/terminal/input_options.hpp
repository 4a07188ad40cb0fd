#pragma once

#include <CLI/CLI.hpp>
#include <filesystem>
#include <optional>
#include <span>
#include <string>

#include "vantage/evaluation/run.hpp"
#include "vantage/io/scan_source.hpp"
#include "vantage/result.hpp"

namespace vantage {

/// The help of options that several programs share.
inline constexpr const char* kPoseTopicHelp =
    "topic in that bag, if it has several; for transforms, with frames: /tf:map:base_link";
inline constexpr const char* kMountHelp =
    "pose of the sensor in the frame of the bag's poses, x,y,z,roll,pitch,yaw [m, rad], if no "
    "/tf_static contains it";
inline constexpr const char* kPriorSigmaHelp =
    "standard deviations of the prior: horizontal,vertical,heading [m, m, deg], 'inf' if unknown; "
    "if left out, those of the messages, or 5,1,10 where they say nothing";
inline constexpr const char* kMapProjectorHelp =
    "Autoware's map_projector_info.yaml, for priors of NavSatFix; if left out, the one beside the "
    "map's files";

inline constexpr const char* kImuTopicHelp =
    "topic of sensor_msgs/Imu in that bag, if it has several";
inline constexpr const char* kImuByFrameHelp =
    "frame k of KITTI's oxts gets the stamp k / --rate, like scans without stamps, instead of that "
    "in timestamps.txt";

/// The options of scans that say what their stamps and tags mean.
struct ScanChoice {
  std::optional<io::StampedPoint> stamped = {};
  io::Tags tags = io::Tags::all;

  void add_to(CLI::App& app);
};

/// The options that select the inputs of a run.
struct InputOptions {
  std::filesystem::path scans = {};
  /// Paths, or topics of the scans' bag; empty for none.
  std::filesystem::path reference = {}, odometry = {};
  std::string topic = {};                                 ///< of the scans, if a bag has several
  std::string reference_topic = {}, odometry_topic = {};  ///< of bags, see io::TrajectorySource
  std::string prior = {};        ///< a path, or a topic of the scans' bag; empty for none
  std::string prior_topic = {};  ///< see io::PriorSource
  std::string prior_sigma = {};  ///< horizontal,vertical,heading [m, m, deg], or empty
  std::filesystem::path map_projector = {};
  std::string mount = {};  ///< --mount: x,y,z,roll,pitch,yaw, or empty
  std::string imu = {};    ///< a path, or a topic of the scans' bag; empty for none
  std::string imu_topic = {};
  bool imu_by_frame = false;  ///< see io::ImuSource::frame_rate_hz
  ScanChoice choice = {};
  TimeWindow window = {};
  double rate_hz = 10.0;

  /// @param recording  the name of the option of the scans
  void add_to(CLI::App& app, bool reference_required, const std::string& recording = "--scans");
  /// @param map_files  the files of the map, beside which the projection of priors may be
  [[nodiscard]] Result<RunInputs> open(std::span<const std::filesystem::path> map_files = {}) const;
};

}  // namespace vantage
