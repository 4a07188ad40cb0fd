#include "io/formats.hpp"

#include <algorithm>

#include "io/cloud_formats.hpp"
#include "io/file_suffix.hpp"
#include "io/las.hpp"
#include "io/ros/bag_readers.hpp"
#include "io/velodyne/capture.hpp"

namespace vantage::io {
namespace {

// clang-format off
/// Messages list formats in this order.
constexpr std::array kFormats{
    Format{"PCD", {".pcd"}, "ascii, binary, binary_compressed",
           looks_like_pcd, kScan | kMap | kByName, {read_pcd, pcd_layout, pcd_parts}},
    Format{"PLY", {".ply"}, "1.0: ascii, binary of either byte order",
           looks_like_ply, kScan | kMap | kByName, {read_ply, ply_layout, ply_parts}},
    Format{"LAS", {".las"}, "1.0 to 1.4, point formats 0 to 10",
           looks_like_las, kMap, {read_las, las_layout, las_parts}},
    Format{"LAZ, COPC", {".laz"}, "not read: convert it with PDAL or laszip",
           nullptr, kMap | kRefused},  // by content it is LAS, whose reader refuses it
    Format{"E57", {".e57"}, "not read: convert it with PDAL or CloudCompare",
           looks_like_e57, kMap | kRefused, {read_e57, e57_layout, e57_parts}},
    Format{"KITTI .bin", {".bin"}, "float32 x y z intensity, little endian",
           nullptr, kScan | kByName, {read_kitti_bin, kitti_bin_layout, kitti_bin_parts}},
    Format{"TUM", {}, "text, a pose a line: t x y z qx qy qz qw",
           nullptr, kTrajectory},
    Format{"KITTI", {}, "text, a pose a line: 3x4 matrix, also after a frame number",
           nullptr, kTrajectory},
    Format{"IMU CSV", {".csv"}, "t,wx,wy,wz,ax,ay,az, or EuRoC's columns",
           nullptr, kInertial},
    Format{"KITTI oxts", {}, "the folder with data/ and timestamps.txt",
           nullptr, kInertial},
    Format{"rosbag1", {".bag"}, "2.0: none, bz2, lz4; with an index or without",
           ros::looks_like_rosbag1, kNothing, {}, ros::read_rosbag1, nullptr, "ROS bag"},
    Format{"rosbag2", {".db3"}, "SQLite, messages also in zstd; or its folder",
           ros::looks_like_sqlite, kBagPart, {}, ros::read_rosbag2_sqlite, nullptr, "ROS bag"},
    Format{"MCAP", {".mcap"}, "none, lz4, zstd; with an index or without",
           ros::looks_like_mcap, kBagPart, {}, ros::read_mcap},
    Format{"Velodyne capture", {".pcap", ".pcapng"}, "VLP-16, HDL-32E",
           looks_like_pcap, kNothing, {}, nullptr, open_velodyne_capture},
};
// clang-format on

bool has_use(const Format& format, FormatUse use) noexcept {
  if (format.is(kRefused)) return false;
  switch (use) {
    case FormatUse::cloud: return format.cloud.read != nullptr;
    case FormatUse::scan: return format.is(kScan);
    case FormatUse::map: return format.is(kMap);
    case FormatUse::recording: return format.open_bag != nullptr || format.open_capture != nullptr;
    case FormatUse::trajectory: return format.open_bag != nullptr || format.is(kTrajectory);
    case FormatUse::imu: return format.open_bag != nullptr || format.is(kInertial);
  }
  return false;
}

/// "a, b or c"; each once.
std::string list(std::span<const std::string_view> items, std::string_view last = " or ") {
  std::vector<std::string_view> once;
  for (const std::string_view item : items) {
    if (std::find(once.begin(), once.end(), item) == once.end()) once.push_back(item);
  }
  std::string text;
  for (std::size_t i = 0; i < once.size(); ++i) {
    if (i > 0) text += i + 1 == once.size() ? last : ", ";
    text += once[i];
  }
  return text;
}

template <class Wanted>
std::string names_of(const Wanted& wanted) {
  std::vector<std::string_view> names;
  for (const Format& format : kFormats) {
    if (wanted(format)) names.push_back(format.name);
  }
  return list(names);
}

}  // namespace

std::span<const Format> format_table() noexcept { return kFormats; }

std::string_view to_string(FormatUse use) noexcept {
  switch (use) {
    case FormatUse::cloud: return "cloud";
    case FormatUse::scan: return "scan";
    case FormatUse::map: return "map";
    case FormatUse::recording: return "recording";
    case FormatUse::trajectory: return "trajectory";
    case FormatUse::imu: return "IMU";
  }
  return "?";
}

std::vector<FormatDescription> formats() {
  std::vector<FormatDescription> described;
  for (const Format& format : kFormats) {
    FormatDescription row{.name = format.name, .extensions = {}, .uses = {}, .help = format.help};
    for (const std::string_view extension : format.extensions) {
      if (!extension.empty()) row.extensions.push_back(extension);
    }
    for (const FormatUse use : {FormatUse::cloud, FormatUse::scan, FormatUse::map,
                                FormatUse::recording, FormatUse::trajectory, FormatUse::imu}) {
      if (has_use(format, use)) row.uses.push_back(use);
    }
    described.push_back(std::move(row));
  }
  return described;
}

std::string format_names(FormatUse use, std::string_view last) {
  std::vector<std::string_view> names;
  for (const Format& format : kFormats) {
    if (has_use(format, use)) names.push_back(format.family.empty() ? format.name : format.family);
  }
  return list(names, last);
}

bool has_extension_of(const Format& format, const std::filesystem::path& path) {
  const std::string suffix = lower_case_suffix(path);
  return !suffix.empty() && std::find(format.extensions.begin(), format.extensions.end(), suffix) !=
                                format.extensions.end();
}

bool has_extension_of(FormatTrait trait, const std::filesystem::path& path) {
  return find_format([&](const Format& format) {
           return format.is(trait) && has_extension_of(format, path);
         }) != nullptr;
}

bool is_only_map(const std::filesystem::path& path) {
  return has_extension_of(kMap, path) && !has_extension_of(kScan, path);
}

std::string extension_list(FormatTrait trait) {
  std::vector<std::string_view> extensions;
  for (const Format& format : kFormats) {
    if (!format.is(trait) || format.is(kRefused)) continue;
    for (const std::string_view extension : format.extensions) {
      if (!extension.empty()) extensions.push_back(extension);
    }
  }
  return list(extensions);
}

std::string bag_names() {
  return names_of([](const Format& format) { return format.open_bag != nullptr; });
}

std::string text_trajectory_names() {
  return names_of([](const Format& format) { return format.is(kTrajectory); });
}

}  // namespace vantage::io
