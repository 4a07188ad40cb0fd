#include <doctest/doctest.h>

#include <algorithm>
#include <fstream>
#include <limits>
#include <nlohmann/json.hpp>

#include "info/recording_info.hpp"
#include "io/ros/message_writers.hpp"
#include "support/bags/bags.hpp"
#include "support/bags/imu_messages.hpp"
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

TEST_CASE("info: a bag that is cut off is described up to the cut") {
  const TemporaryFolder folder;
  std::vector<TestMessage> messages;
  for (std::int64_t tenths = 10; tenths < 20; ++tenths) messages.push_back(cloud("/a", tenths));
  const std::string whole = test::mcap(messages, {.indexed = false});
  const RecordingInfo complete =
      inspected({.path = put(folder.path() / "whole.mcap", test::mcap(messages)), .topic = {}});
  CHECK_FALSE(complete.damage);
  const auto path = put(folder.path() / "cut.mcap", whole.substr(0, whole.size() / 2));
  const RecordingInfo info = inspected({.path = path, .topic = {}});
  REQUIRE(info.scans);
  CHECK(info.scans->count >= 2);
  CHECK(info.scans->count < 10);
  REQUIRE(info.damage);
  CHECK(info.damage->message.starts_with("the file ends at byte"));
  CHECK(to_json(info)["damage"] == to_string(*info.damage));
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

/// A sample of an IMU that is at rest upside down, in g.
TestMessage imu(const std::string& topic, std::int64_t hundredths, double force = -1.0) {
  const auto nanoseconds = static_cast<std::uint32_t>(hundredths % 100 * (kTenth / 10));
  return {topic, "sensor_msgs/msg/Imu", kTenth / 10 * hundredths,
          test::imu_message({.seconds = static_cast<std::uint32_t>(hundredths / 100),
                             .nanoseconds = nanoseconds,
                             .rate = {0.01, 0.0, -0.02},
                             .force = {0.0, 0.0, force}},
                            test::MessageWriter::Layout::cdr_little)};
}

TEST_CASE("info: the IMU of a bag, beside its scans") {
  const TemporaryFolder folder;
  std::vector<TestMessage> messages;
  for (std::int64_t i = 50; i < 250; ++i) messages.push_back(imu("/imu", i));
  messages.push_back(imu("/imu", 249));
  messages.push_back(imu("/broken", 100, 5.0));
  messages.push_back(imu("/early", 10));
  for (const std::int64_t tenths : {10, 11, 12}) messages.push_back(cloud("/points", tenths));
  std::stable_sort(messages.begin(), messages.end(),
                   [](const auto& a, const auto& b) { return a.log_time < b.log_time; });
  const RecordingInfo info =
      inspected({.path = put(folder.path() / "run.mcap", test::mcap(messages)), .topic = {}});
  REQUIRE(info.imus.size() == 3);
  const std::string text = to_text(info, {});
  CAPTURE(text);
  for (const char* line :
       {"IMU                    /imu\n", "IMU frame              imu\n",
        "IMU samples            200\n",
        "0 left out without a number or a stamp, 1 with the stamp of another one, 0 sorted in",
        "IMU rate [Hz]          100.000\n",
        "0.500000, 2.490000; begins 0.500 s before the scans, ends 1.290 s after them\n",
        "in g: 1.000 while it moves least\n", "for the first 2.0 s\n",
        "along -0.000, -0.000, 1.000, 9.807 m/s^2\n", "0.01000, 0.00000, -0.02000\n",
        "a mean norm of 5 in the second", "not at the time of the scans, 1.000000 to 1.200000"}) {
    CAPTURE(line);
    CHECK(text.find(line) != std::string::npos);
  }
  const auto json = to_json(info);
  REQUIRE(json["imu"].size() == 3);
  const auto imu_of = [&](const std::string& topic) -> nlohmann::ordered_json {
    for (const auto& entry : json["imu"]) {
      if (entry["topic"] == topic) return entry;
    }
    return {};
  };
  CHECK(imu_of("/imu")["unit"] == "g");
  CHECK(imu_of("/imu")["overlaps_scans"] == true);
  CHECK(imu_of("/imu")["rest"]["gravity_direction"][2] == 1.0);
  CHECK(imu_of("/imu")["duplicates"] == 1);
  CHECK(imu_of("/broken")["problem"].get<std::string>().find("norm of 5") != std::string::npos);
  CHECK(imu_of("/early")["overlaps_scans"] == false);
  CHECK(imu_of("/early")["rest"].is_null());
}

TEST_CASE("info: files of inertial samples, and a bag with nothing else") {
  const TemporaryFolder folder;
  const auto csv = put(folder.path() / "imu.csv", "t,wx,wy,wz,ax,ay,az\n1,0,0,0,0,0,9.8\n");
  const RecordingInfo file = inspected({.path = csv, .topic = {}});
  CHECK(file.format == "IMU CSV");
  const std::string text = to_text(file, {});
  CAPTURE(text);
  CHECK(text.find("IMU samples          1\n") != std::string::npos);
  CHECK(text.find("IMU at rest          not at the beginning\n") != std::string::npos);
  CHECK(to_json(file)["imu"][0]["count"] == 1);
  const auto bag = put(folder.path() / "a.mcap", test::mcap({imu("/imu", 1), imu("/imu", 2)}));
  const RecordingInfo only = inspected({.path = bag, .topic = {}});
  CHECK_FALSE(only.scans.has_value());
  CHECK(only.no_scans.find("no topic has scans") != std::string::npos);
  REQUIRE(only.imus.size() == 1);
  CHECK(only.imus[0].recording->samples.size() == 2);
  const auto damaged = put(folder.path() / "b.csv", "t,wx,wy,wz,ax,ay,az\n1,0,0\n");
  const auto refused = inspect({.path = damaged, .topic = {}}, {});
  REQUIRE_FALSE(refused);
  CHECK(refused.error().where.value().line == 2);
}

}  // namespace
}  // namespace vantage
