#pragma once

#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "vantage/io/point_times.hpp"
#include "vantage/point_cloud.hpp"
#include "vantage/result.hpp"

namespace vantage::io {

/// One scan in the sensor frame [m].
struct StampedScan {
  double stamp = 0.0;  ///< [s]
  PointCloud points;
  std::vector<float> seconds;    ///< of each point after `stamp` [s]; empty if the file has none
  std::uint64_t dropped = 0;     ///< points with a NaN or infinite coordinate, left out of `points`
  std::string name;              ///< for messages: the file and the place in a recording
  std::uint64_t no_returns = 0;  ///< points at exactly (0, 0, 0), which is how drivers write that
                                 ///< nothing came back; left out of `points`
  std::uint64_t noise = 0;       ///< points left out by Tags::normal
};

/// Which points are taken of sensors that tag their points (Livox). Bits 0-1 of a tag are not 0 if
/// the place of a point makes it doubtful, bits 2-3 if its intensity does (rain, dust). The other
/// bits differ between sensors and are not looked at.
enum class Tags : std::uint8_t {
  all,    ///< matching can bear some noise, and no sensor is trusted to know it
  normal  ///< only points whose bits 0 to 3 are 0
};

/// Where scans are read from.
struct ScanOptions {
  std::filesystem::path path;  ///< a folder of scans, one scan or a recording
  std::string topic;           ///< needed for a bag with several topics; otherwise may be empty
  double rate_hz = 10.0;       ///< scan rate of files without stamps [Hz]
  /// Which point of a scan its stamp belongs to; if left out, the times of the points say it, see
  /// seconds_after.
  std::optional<StampedPoint> stamped = {};
  Tags tags = Tags::all;
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
  /// No scan is stamped later [s], if the recording says so before its scans are read. A bag says
  /// when its last message was recorded, of any topic, so it may be later than the last scan.
  std::optional<double> last_stamp = {};
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
///   sensor_msgs/PointCloud2, livox_ros_driver(2)/CustomMsg or velodyne_msgs/VelodyneScan
/// - Velodyne captures (.pcap, .pcapng) of a VLP-16 or HDL-32
/// Errors (`where` is the file): `not_found`; `invalid_input` for a topic that does not exist, for
/// several topics without a choice (the message lists the topics), for a topic if the format has no
/// topics, for a bad rate, for `stamped` if the stamps are those of packets, and for Tags::normal
/// if points have no tags; `corrupt_data`; `io_failure`; `unsupported` for a format that must be
/// converted, with the name of a converter.
[[nodiscard]] Result<std::unique_ptr<ScanSource>> open_scans(const ScanOptions& options);

}  // namespace vantage::io
