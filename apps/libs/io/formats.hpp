#pragma once

#include <array>
#include <cstddef>
#include <filesystem>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <utility>

#include "io/point_fields.hpp"
#include "io/ros/message_reader.hpp"
#include "vantage/io/formats.hpp"
#include "vantage/io/point_cloud_io.hpp"
#include "vantage/io/scan_source.hpp"
#include "vantage/kit/file_content.hpp"

namespace vantage::io {

/// A file that is read as a cloud. Its beginning is read at once, all of it only where a format
/// asks for it, and then once.
class CloudFile {
 public:
  /// Errors: `io_failure`. @param input  must outlive it
  [[nodiscard]] static Result<CloudFile> of(const InputFile& input);

  [[nodiscard]] const InputFile& input() const noexcept { return *input_; }
  [[nodiscard]] const std::string& name() const noexcept { return input_->name(); }
  /// The beginning of the file, at most 64 KiB, by which its format is recognized. It may end
  /// within the file's header.
  [[nodiscard]] std::string_view head() const noexcept { return head_; }
  [[nodiscard]] bool is_all_head() const noexcept { return head_.size() == input_->size(); }
  /// Errors: `io_failure`.
  [[nodiscard]] Result<std::string_view> content();

 private:
  explicit CloudFile(const InputFile& input) noexcept : input_(&input) {}

  const InputFile* input_;
  std::string head_;
  std::optional<FileContent> content_;
};

/// What a format may be, as bits.
enum FormatTrait : unsigned {
  kNothing = 0,
  kScan = 1,        ///< a scan, in a folder of scans
  kMap = 2,         ///< a part of a map, in the folder of one
  kBagPart = 4,     ///< a part of a rosbag2, in its folder
  kTrajectory = 8,  ///< a text file, see read_trajectory
  kByName = 16,  ///< the name decides if no probe knows the content: this reader explains best what
                 ///< is wrong, or the format has no probe
  kRefused = 32,   ///< with a converter
  kInertial = 64,  ///< files with inertial samples, see read_imu
};

/// How a cloud can be read without all of it in memory.
struct CloudParts {
  std::optional<Records> records;  ///< points that are read in blocks; none if only all at once
  std::uint64_t points = 0;        ///< that the header states; 0 if it is not known
  std::uint64_t memory = 0;        ///< for reading all at once, at most [bytes]; 0 with `records`
};

/// Of a file of points of equal size.
[[nodiscard]] inline CloudParts parts_of(Records records) {
  const std::uint64_t points = records.count;
  return {.records = std::move(records), .points = points, .memory = 0};
}

/// How clouds of a format are read; null if the format has no clouds.
struct CloudReader {
  Result<LoadedCloud> (*read)(CloudFile& file, ReadTimes read_times) = nullptr;
  Result<CloudLayout> (*layout)(const CloudFile& file) = nullptr;
  Result<CloudParts> (*parts)(const CloudFile& file) = nullptr;
};

/// What vantage::io knows of a format: what messages call it, how it is told, how it is read.
struct Format {
  std::string_view name;
  std::array<std::string_view, 3> extensions{};  ///< in lower case; the rest is empty
  std::string_view help;                         ///< which variants are read
  /// Whether content (its first 64 bytes, where these are enough) is of this format; null where
  /// only names tell.
  bool (*probe)(std::string_view head) noexcept = nullptr;
  unsigned traits = kNothing;
  CloudReader cloud = {};
  Result<std::unique_ptr<ros::MessageReader>> (*open_bag)(InputFile file) = nullptr;
  Result<std::unique_ptr<ScanSource>> (*open_capture)(InputFile file,
                                                      const std::string& sensor) = nullptr;
  std::string_view family = {};  ///< what users call it; the name if empty

  [[nodiscard]] bool is(FormatTrait trait) const noexcept { return (traits & trait) != 0; }
};

/// All that is read: one row a format.
[[nodiscard]] std::span<const Format> format_table() noexcept;

/// The first row that says yes; null if none does. @param wanted  bool(const Format&)
template <class Wanted>
[[nodiscard]] const Format* find_format(const Wanted& wanted) {
  for (const Format& format : format_table()) {
    if (wanted(format)) return &format;
  }
  return nullptr;
}

/// The format of a file that is read as a cloud, by its content, otherwise by its name.
/// Errors: `corrupt_data` for a format that is not known; `io_failure`.
[[nodiscard]] Result<const Format*> cloud_format(CloudFile& file);
/// "a point cloud (PCD, PLY, ...)".
[[nodiscard]] std::string expected_cloud();

/// Whether the file's name ends like those of the format.
[[nodiscard]] bool has_extension_of(const Format& format, const std::filesystem::path& path);
/// Whether the name ends like those of a format with that trait, also of a refused one.
[[nodiscard]] bool has_extension_of(FormatTrait trait, const std::filesystem::path& path);
/// Whether the name is that of a map and never that of a scan: "map.las".
[[nodiscard]] bool is_only_map(const std::filesystem::path& path);

/// ".pcd, .ply or .bin": of the formats with that trait that are not refused.
[[nodiscard]] std::string extension_list(FormatTrait trait);
/// "rosbag1, rosbag2 or MCAP": the names of all bags.
[[nodiscard]] std::string bag_names();
/// "TUM or KITTI".
[[nodiscard]] std::string text_trajectory_names();

}  // namespace vantage::io
