#pragma once

#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "vantage/point_cloud.hpp"
#include "vantage/result.hpp"

namespace vantage::io {

/// One scan in the sensor frame [m].
struct StampedScan {
  double stamp = 0.0;  ///< [s]
  PointCloud points;
  std::vector<float> seconds;  ///< time of each point after `stamp`; empty if the file has no times
  std::uint64_t dropped = 0;   ///< points with a NaN or infinite coordinate, left out of `points`
  std::string name;            ///< for messages: the file and, in a recording, the place in it
};

/// Where scans are read from.
struct ScanOptions {
  std::filesystem::path path;  ///< a folder of scans, one scan or a recording
  std::string topic;           ///< of a bag with several topics; empty if there is only one
  double rate_hz = 10.0;       ///< of files that carry no stamps [Hz]
};

/// Why scans were left out, and how many.
struct SkippedScans {
  std::uint64_t not_later = 0;   ///< stamped no later than the scan before
  std::uint64_t incomplete = 0;  ///< sweeps cut off by the beginning or end of a capture

  [[nodiscard]] std::uint64_t total() const noexcept { return not_later + incomplete; }
};

/// What is known about a recording before its points are read.
struct ScanDescription {
  std::string format;                  ///< "rosbag1 2.0 (lz4)"
  std::string topic;                   ///< empty if there are no topics
  std::string frame;                   ///< frame_id of the first scan; empty if there is none
  std::vector<std::string> fields;     ///< of the first scan's points: "x float32"
  std::string stamp_rule;              ///< a sentence that says where the stamps come from
  std::optional<std::uint64_t> scans;  ///< if the file says it; includes scans that will be skipped
};

/// Recorded scans, one after the other, with strictly increasing stamps. A scan without a finite
/// point is a scan, too. Memory use is that of a few scans, whatever the size of the recording.
class ScanSource {
 public:
  ScanSource() = default;
  virtual ~ScanSource() = default;
  ScanSource(const ScanSource&) = delete;
  ScanSource& operator=(const ScanSource&) = delete;

  /// The next scan; nothing at the end. Scans that cannot be used are left out and counted.
  /// Errors (`where` is the file; the message gives the byte): `corrupt_data`, `io_failure`. After
  /// an error, the source gives nothing more.
  [[nodiscard]] virtual Result<std::optional<StampedScan>> next() = 0;
  /// Makes next() continue with the first scan stamped at or after `stamp` [s]; counts start again.
  /// Errors: those of next().
  [[nodiscard]] virtual Result<void> seek(double stamp) = 0;
  /// The description is the same from the beginning to the end.
  [[nodiscard]] virtual const ScanDescription& describe() const = 0;
  /// Scans skipped since the beginning or the last seek().
  [[nodiscard]] virtual SkippedScans skipped() const = 0;
};

/// Opens anything that holds scans. The content tells the format, not the name:
/// - a folder of .pcd, .ply and KITTI .bin files, or one of them: see ScanSequence
/// - rosbag1 (.bag), rosbag2 (.db3 or .mcap, alone or as their folder), MCAP: a topic of
///   sensor_msgs/PointCloud2 or velodyne_msgs/VelodyneScan
/// - Velodyne captures (.pcap, .pcapng) of a VLP-16 or HDL-32
/// Errors (`where` is the file): `not_found`; `invalid_input` for a topic that does not exist or
/// that must be chosen (the message lists the topics), for a topic with a format that has none, and
/// for a bad rate; `corrupt_data`; `io_failure`; `unsupported` for formats that must be converted,
/// with the name of a converter.
[[nodiscard]] Result<std::unique_ptr<ScanSource>> open_scans(const ScanOptions& options);

}  // namespace vantage::io
