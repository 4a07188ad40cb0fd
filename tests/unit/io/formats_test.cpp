// The table of formats: what lists, folders and readers take from its rows.
#include "io/formats.hpp"

#include <doctest/doctest.h>

#include <algorithm>
#include <set>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "files.hpp"
#include "vantage/io/map_files.hpp"
#include "vantage/io/scan_source.hpp"

namespace vantage {
namespace {

using io::Format;
using io::format_names;
using io::FormatUse;

TEST_CASE("formats: every row has a name and extensions of its own, and a use or a converter") {
  std::set<std::string_view> names, extensions;
  for (const Format& format : io::format_table()) {
    CAPTURE(format.name);
    CHECK(names.insert(format.name).second);
    CHECK_FALSE(format.help.empty());
    for (const std::string_view extension : format.extensions) {
      if (extension.empty()) continue;
      CHECK(extensions.insert(extension).second);
      CHECK(extension.starts_with('.'));
      CHECK(std::none_of(extension.begin(), extension.end(),
                         [](char c) { return c >= 'A' && c <= 'Z'; }));
    }
    // Content tells what a recording is; a cloud may be told by its name alone.
    if (format.open_bag != nullptr || format.open_capture != nullptr)
      CHECK((format.probe != nullptr));
    if (format.cloud.read != nullptr) {
      CHECK((format.probe != nullptr || format.is(io::kByName)));
      CHECK((format.cloud.layout != nullptr));
    }
    const bool is_read = format.cloud.read != nullptr || format.open_bag != nullptr ||
                         format.open_capture != nullptr || format.is(io::kTrajectory) ||
                         format.is(io::kInertial);
    CHECK((is_read || format.is(io::kRefused)));
  }
}

TEST_CASE("formats: no content is of two formats") {
  for (const Format& format : io::format_table()) {
    CHECK((format.probe == nullptr || !format.probe("")));
  }
  using namespace std::string_view_literals;
  for (const std::string_view head :
       {"# .PCD v0.7\n"sv, "VERSION .7\n"sv, "ply\n"sv, "LASF\0"sv, "ASTM-E57"sv,
        "#ROSBAG V2.0\n"sv, "SQLite format 3\0"sv, "\x89MCAP0\r\n"sv, "\xD4\xC3\xB2\xA1"sv,
        "\x0A\x0D\x0D\x0A"sv}) {
    CAPTURE(head);
    const auto rows = io::format_table();
    CHECK(std::count_if(rows.begin(), rows.end(), [&](const Format& format) {
            return format.probe != nullptr && format.probe(head);
          }) == 1);
  }
}

TEST_CASE("formats: what lists say") {
  CHECK(format_names(FormatUse::cloud) == "PCD, PLY, LAS or KITTI .bin");
  CHECK(format_names(FormatUse::scan) == "PCD, PLY or KITTI .bin");
  CHECK(format_names(FormatUse::map) == "PCD, PLY or LAS");
  CHECK(format_names(FormatUse::recording) == "ROS bag, MCAP or Velodyne capture");
  CHECK(format_names(FormatUse::recording, ", ") == "ROS bag, MCAP, Velodyne capture");
  CHECK(format_names(FormatUse::trajectory) == "TUM, KITTI, ROS bag or MCAP");
  CHECK(format_names(FormatUse::imu) == "IMU CSV, KITTI oxts, ROS bag or MCAP");
  // Another extension of a format changes its row, and nothing here.
  for (const auto& [trait, first] :
       {std::pair(io::kScan, ".pcd"), {io::kMap, ".pcd"}, {io::kBagPart, ".db3"}}) {
    std::vector<std::string> extensions;
    for (const Format& format : io::format_table()) {
      if (!format.is(trait) || format.is(io::kRefused)) continue;
      for (const std::string_view extension : format.extensions) {
        if (!extension.empty()) extensions.emplace_back(extension);
      }
    }
    REQUIRE(extensions.size() >= 2);
    CHECK(extensions.front() == first);
    std::string list;
    for (std::size_t i = 0; i < extensions.size(); ++i) {
      if (i > 0) list += i + 1 == extensions.size() ? " or " : ", ";
      list += extensions[i];
    }
    CHECK(io::extension_list(trait) == list);
  }
  CHECK(io::bag_names() == "rosbag1, rosbag2 or MCAP");
  CHECK(io::text_trajectory_names() == "TUM or KITTI");
}

TEST_CASE("formats: what is described for users") {
  const auto described = io::formats();
  REQUIRE(described.size() == io::format_table().size());
  const auto& pcd = described.front();
  CHECK(pcd.name == "PCD");
  CHECK(pcd.extensions == std::vector<std::string_view>{".pcd"});
  CHECK(pcd.uses == std::vector{FormatUse::cloud, FormatUse::scan, FormatUse::map});
  for (const auto& format : described) {
    CAPTURE(format.name);
    CHECK(format.uses.empty() == (format.help.find("not read") == 0));
  }
}

TEST_CASE("formats: a folder takes the files that the rows name, in any case of letters") {
  const std::string point = test::raw(1.0F) + test::raw(2.0F) + test::raw(3.0F) + test::raw(0.5F);
  for (const Format& format : io::format_table()) {
    for (const std::string_view lower : format.extensions) {
      if (lower.empty()) continue;
      std::string extension(lower);
      std::transform(extension.begin(), extension.end(), extension.begin(),
                     [](char c) { return c >= 'a' && c <= 'z' ? static_cast<char>(c - 32) : c; });
      const test::TemporaryFolder alone;
      const auto file = test::put(alone.path() / ("7" + extension), point);
      CAPTURE(file);
      const std::vector<std::filesystem::path> pattern{alone.path()};
      CHECK(io::map_files(pattern).has_value() == format.is(io::kMap));
      CHECK(io::is_only_map(file) == (format.is(io::kMap) && !format.is(io::kScan)));
      if (format.is(io::kBagPart)) continue;  // the folder of a bag
      CHECK(io::open_scans({.path = alone.path(), .topic = {}}).has_value() ==
            format.is(io::kScan));
    }
  }
}

}  // namespace
}  // namespace vantage
