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
  std::vector<float> seconds;  ///< of each point after `stamp` [s]; empty if the file has none
  std::uint64_t dropped = 0;   ///< points with a NaN or infinite coordinate, left out of `points`
  std::string name;            ///< for messages: the file and the place in a recording
};

/// Where scans are read from.
struct ScanOptions {
  std::filesystem::path path;  ///< a folder of scans, one scan or a recording
  std::string topic;           ///< needed for a bag with several topics; otherwise may be empty
  double rate_hz = 10.0;       ///< scan rate of files without stamps [Hz]
};

/// How many scans were left out, by reason.
struct SkippedScans {
  std::uint64_t not_later = 0;   ///< the stamp is not later than that of the scan before
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

/// Recorded scans, one after the other, with strictly increasing stamps. A scan without any finite
/// point counts, too. Memory holds a few scans at a time, whatever the size of the recording.
class ScanSource {
 public:
  ScanSource() = default;
  virtual ~ScanSource() = default;
  ScanSource(const ScanSource&) = delete;
  ScanSource& operator=(const ScanSource&) = delete;

  /// The next scan; none at the end. Scans that cannot be used are left out and counted.
  /// Errors (`where` is the file; the message gives the byte): `corrupt_data`, `io_failure`. After
  /// an error, the source has no more scans.
  [[nodiscard]] virtual Result<std::optional<StampedScan>> next() = 0;
  /// Continues next() at the first scan stamped at or after `stamp` [s]. Resets skipped().
  /// Errors: those of next().
  [[nodiscard]] virtual Result<void> seek(double stamp) = 0;
  /// The description of the recording; next() and seek() do not change it.
  [[nodiscard]] virtual const ScanDescription& describe() const = 0;
  /// Scans skipped since the beginning or the last seek().
  [[nodiscard]] virtual SkippedScans skipped() const = 0;
};

/// Opens anything that holds scans. The content determines the format; only KITTI needs its suffix:
/// - a folder of .pcd, .ply and KITTI .bin files, or one such file: see ScanSequence
/// - rosbag1 (.bag), rosbag2 (.db3 or .mcap, one file or the folder), MCAP: a topic of type
///   sensor_msgs/PointCloud2 or velodyne_msgs/VelodyneScan
/// - Velodyne captures (.pcap, .pcapng) of a VLP-16 or HDL-32
/// Errors (`where` is the file): `not_found`; `invalid_input` for a topic that does not exist, for
/// several topics without a choice (the message lists the topics), for a topic if the format has no
/// topics, and for a bad rate; `corrupt_data`; `io_failure`; `unsupported` for a format that must
/// be converted, with the name of a converter.
[[nodiscard]] Result<std::unique_ptr<ScanSource>> open_scans(const ScanOptions& options);

}  // namespace vantage::io
