#include <doctest/doctest.h>

#include <fstream>
#include <limits>
#include <nlohmann/json.hpp>

#include "info/recording_info.hpp"
#include "io/ros/message_writers.hpp"
#include "support/bags/bags.hpp"
#include "support/real_data.hpp"
#include "vantage/io/formats.hpp"
#include "vantage/io/point_cloud_io.hpp"

namespace vantage {
namespace {

using test::TemporaryFolder;
using test::TestMessage;

constexpr std::int64_t kTenth = 100'000'000;  // [ns]

TestMessage cloud(const std::string& topic, std::int64_t tenths) {
  const double stamp = 0.1 * static_cast<double>(tenths);
  const PointCloud points{{1.0, 2.0, 3.0},
                          {-1.0, 0.5, 1e300},  // beyond float32: written as NaN
                          {static_cast<double>(tenths), 0.0, 0.0}};
  return {topic, "sensor_msgs/msg/PointCloud2", kTenth * tenths,
          io::ros::write_point_cloud2({.stamp = stamp, .frame = "velodyne"}, points).value()};
}

std::filesystem::path put(const std::filesystem::path& path, const std::string& content) {
  std::ofstream(path, std::ios::binary) << content;
  return path;
}

RecordingInfo inspected(const io::ScanOptions& options) {
  auto info = inspect(options, {});
  REQUIRE_MESSAGE(info, to_string(info.error()));
  return *std::move(info);
}

TEST_CASE("info: a bag with a gap, a scan that goes back in time and a NaN in each") {
  const TemporaryFolder folder;
  std::vector<TestMessage> messages;
  for (const std::int64_t tenths : {10, 11, 12, 11, 13, 20, 21}) {
    messages.push_back(cloud("/points", tenths));
  }
  for (std::size_t i = 0; i < messages.size(); ++i) {
    messages[i].log_time = kTenth * static_cast<std::int64_t>(100 + i);
  }
  messages.push_back(
      {"/name", "std_msgs/msg/String", kTenth * 200, io::ros::write_string("a").value()});
  const auto path = put(folder.path() / "run.mcap", test::mcap(messages));
  const RecordingInfo info = inspected({.path = path, .topic = {}});
  CHECK(info.format == "MCAP (none)");
  REQUIRE(info.scans);
  const ScansInfo& scans = *info.scans;
  CHECK(scans.description.topic == "/points");
  CHECK(scans.description.frame == "velodyne");
  CHECK(scans.description.fields ==
        std::vector<std::string>{"x float32", "y float32", "z float32"});
  CHECK(scans.count == 6);
  CHECK(scans.skipped.not_later == 1);
  CHECK(scans.first == doctest::Approx(1.0));
  CHECK(scans.last == doctest::Approx(2.1));
  CHECK(scans.interval == doctest::Approx(0.1));
  REQUIRE(scans.gaps.size() == 1);
  CHECK(scans.gaps.front().after == doctest::Approx(1.3));
  CHECK(scans.gaps.front().seconds == doctest::Approx(0.7));
  CHECK(scans.points.finite == 12);
  CHECK(scans.points.dropped == 6);
  CHECK(scans.points.extent.max().x() == 21.0);

  const auto json = to_json(info);
  CHECK(json["scans"]["points"]["share_not_finite"] == doctest::Approx(1.0 / 3.0));
  CHECK(json["topics"].size() == 2);
  const std::string text = to_text(info, {});
  CAPTURE(text);
  CHECK(text.find("6 (33.33 %)") != std::string::npos);
  CHECK(text.find("1, the longest 0.700 s after 1.300000") != std::string::npos);
  CHECK(text.find("/name") != std::string::npos);
}

TEST_CASE("info: a bag with several topics of scans, and one that is chosen") {
  const TemporaryFolder folder;
  const auto path = put(folder.path() / "run.bag", test::mcap({cloud("/a", 1), cloud("/b", 1)}));
  const RecordingInfo all = inspected({.path = path, .topic = {}});
  CHECK_FALSE(all.scans);
  CHECK(all.no_scans.find("--topic") != std::string::npos);
  CHECK(all.topics.size() == 2);
  CHECK(inspected({.path = path, .topic = "/b"}).scans->description.topic == "/b");
  CHECK_FALSE(inspect({.path = path, .topic = "/c"}, {}));
}

TEST_CASE("info: a map of two files") {
  const TemporaryFolder folder;
  REQUIRE(io::write_las(folder.path() / "a.las", PointCloud{{500'000.25, 4'100'000.5, 12.0}}));
  REQUIRE(io::write_las(folder.path() / "b.las", PointCloud{{500'010.25, 4'100'000.5, 12.0}}));
  const RecordingInfo info = inspected({.path = folder.path(), .topic = {}});
  CHECK(info.format == "map of 2 files, LAS 1.4 (point format 6)");
  REQUIRE(info.map);
  CHECK(info.map->finite == 2);
  CHECK(info.map->extent.sizes().x() == doctest::Approx(10.0));
  CHECK(to_json(info)["map"]["files"] == 2);
}

TEST_CASE("info: names that are no text, and what is not there") {
  const TemporaryFolder folder;
  const auto path = put(folder.path() / "run.mcap", test::mcap({cloud("/a\n\xff", 1)}));
  const RecordingInfo info = inspected({.path = path, .topic = {}});
  CHECK(to_text(info, {}).find("/a\n") == std::string::npos);
  const auto absent = inspect({.path = folder.path() / "none", .topic = {}}, {});
  REQUIRE_FALSE(absent);
  CHECK(absent.error().code == ErrorCode::not_found);
}

TEST_CASE("info: the table of formats has every name and extension") {
  const std::string text = formats_text({});
  for (const io::FormatDescription& format : io::formats()) {
    CHECK(text.find('\n' + std::string(format.name) + ' ') != std::string::npos);
    for (const std::string_view extension : format.extensions) {
      CHECK(text.find(' ' + std::string(extension) + ' ') != std::string::npos);
    }
  }
}

}  // namespace
}  // namespace vantage
