#pragma once

#include <Eigen/Geometry>
#include <cstdint>
#include <filesystem>
#include <functional>
#include <nlohmann/json_fwd.hpp>
#include <optional>
#include <string>
#include <vector>

#include "checks/map_facts.hpp"
#include "io/ros/message_reader.hpp"
#include "terminal/style.hpp"
#include "vantage/io/imu_io.hpp"
#include "vantage/io/scan_source.hpp"
#include "vantage/result.hpp"

namespace vantage {

/// Points of one or many clouds.
struct PointsInfo {
  std::uint64_t finite = 0;
  std::uint64_t dropped = 0;   ///< with a NaN or infinite coordinate
  Eigen::AlignedBox3d extent;  ///< of the finite ones [m]

  void add(PointsView points, std::uint64_t not_finite);
};

/// A pause of more than 1.5 times the median time between scans.
struct Gap {
  double after = 0.0;    ///< stamp of the scan before it [s]
  double seconds = 0.0;  ///< from that scan to the next
};

/// What the scans of a recording contain, found by reading all of them.
struct ScansInfo {
  io::ScanDescription description;
  std::uint64_t count = 0;
  std::uint64_t with_times = 0;  ///< scans whose points have times
  double sweep = 0.0;            ///< the longest time that the points of one scan span [s]
  io::SkippedScans skipped;
  double first = 0.0, last = 0.0;  ///< stamps [s]
  double interval = 0.0;           ///< median time between scans [s]; 0 for a single one
  std::vector<Gap> gaps;
  std::uint64_t no_returns = 0;        ///< points at the sensor, see io::StampedScan
  std::uint64_t fewest = 0, most = 0;  ///< finite points a scan
  PointsInfo points;                   ///< extent in the sensor's frame
};

/// An inertial measurement unit.
struct ImuInfo {
  std::string topic;  ///< empty if there are no topics
  std::optional<io::ImuRecording> recording;
  std::string problem;  ///< why there is no `recording`; else empty
};

/// What a file or folder contains.
struct RecordingInfo {
  std::filesystem::path path;
  std::string format;
  std::uint64_t bytes = 0;
  std::vector<io::ros::Topic> topics;  ///< of a bag
  std::optional<ScansInfo> scans;
  std::optional<PointsInfo> map;  ///< of a map
  std::vector<std::filesystem::path> map_files;
  std::vector<std::string> map_fields;  ///< of the first file's points
  /// Of the file with the most points, if they are as many as a map has.
  std::optional<checks::MapFacts> map_facts;
  std::string no_scans;       ///< why a bag has no readable scans; else empty
  std::vector<ImuInfo> imus;  ///< one a topic of a bag; one of a file of samples
  /// At which a recording ends that is cut off or damaged; what comes before is described.
  std::optional<Error> damage = {};
};

/// Reads the whole recording, or what of it comes before its damage. A bag without scans, or with
/// several topics of scans and none chosen, is described, too. Errors: those of open_scans,
/// ScanSource::next and, for a file or folder of inertial samples, io::read_imu.
/// @param progress  called with the number of scans done and the number of all; the latter is 0 if
///                  the recording does not say
[[nodiscard]] Result<RecordingInfo> inspect(
    const io::ScanOptions& options, const std::function<void(std::size_t, std::size_t)>& progress);

/// A table of all formats that are read.
[[nodiscard]] std::string formats_text(const cli::Style& style);

[[nodiscard]] std::string to_text(const RecordingInfo& info, const cli::Style& style);
[[nodiscard]] nlohmann::ordered_json to_json(const RecordingInfo& info);

}  // namespace vantage
