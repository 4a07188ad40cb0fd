#include "bags.hpp"

namespace vantage::test {
namespace {

using io::ros::is_bag;
using io::ros::open_bag;

std::vector<TestMessage> samples() {
  return two_topics("sensor_msgs/msg/PointCloud2", "sensor_msgs/msg/Imu");
}
std::vector<TestMessage> some(std::size_t first, std::size_t end) {
  const auto all = samples();
  return {all.begin() + static_cast<std::ptrdiff_t>(first),
          all.begin() + static_cast<std::ptrdiff_t>(end)};
}

Error refused(const std::filesystem::path& path) {
  const auto reader = open_bag(path);
  REQUIRE_FALSE(reader.has_value());
  return reader.error();
}

}  // namespace

TEST_CASE("bags: the content tells the format, not the name") {
  const TemporaryFolder folder;
  for (const auto& [bytes, format] : {std::pair{rosbag1(two_topics()), "rosbag1 2.0 (none)"},
                                      std::pair{rosbag2(samples()), "rosbag2 (SQLite)"},
                                      std::pair{mcap(samples()), "MCAP (none)"}}) {
    const auto path = put(folder.path() / "bag.pcd", bytes);
    CHECK(is_bag(path) == true);
    const auto reader = open_bag(path);
    REQUIRE_MESSAGE(reader, to_string(reader.error()));
    CHECK((*reader)->format() == format);
    CHECK(read_on(**reader).messages == in_order(two_topics()));
  }
}

TEST_CASE("bags: recorded ones give the same messages whatever their compression") {
  using io::ros::Encoding;
  const io::ros::Topic ros1{"/points_raw", "sensor_msgs/PointCloud2", Encoding::ros1, "ros1", {}};
  const std::vector<RecordedMessage> in_1{{1317037200000000000, 1974478, 0x6782e59d},
                                          {1317037200099999904, 1971694, 0x7155ff3a},
                                          {1317037200200000047, 1959758, 0x52e2cd27},
                                          {1317037200299999952, 1960382, 0x27ad8038},
                                          {1317037200400000095, 1963182, 0xd9afa0c9}};
  const io::ros::Topic cdr{"/points_raw", "sensor_msgs/PointCloud2", Encoding::cdr, "cdr", {}};
  const std::vector<RecordedMessage> in_mcap{{1317037200000000000, 1974509, 0x804ba41b},
                                             {1317037200100000000, 1971725, 0x96a9173d},
                                             {1317037200200000000, 1959789, 0x910c9b2b},
                                             {1317037200300000000, 1960413, 0x5e98419e}};
  struct Row {
    Open open;
    const char *path, *format;
    const io::ros::Topic& topic;
    const std::vector<RecordedMessage>& messages;
    std::ptrdiff_t count;
  };
  const Open open_1 = io::ros::open_rosbag1, open_mcap = io::ros::open_mcap;
  for (const Row& row : {
           Row{open_1, "rosbag1/kitti0005_5frames_none.bag", "rosbag1 2.0 (none)", ros1, in_1, 5},
           Row{open_1, "rosbag1/kitti0005_3frames_lz4.bag", "rosbag1 2.0 (lz4)", ros1, in_1, 3},
           Row{open_1, "rosbag1/kitti0005_2frames_bz2.bag", "rosbag1 2.0 (bz2)", ros1, in_1, 2},
           Row{open_mcap, "mcap/kitti0005_4frames_none.mcap", "MCAP (none)", cdr, in_mcap, 4},
           Row{open_mcap, "mcap/kitti0005_2frames_lz4.mcap", "MCAP (lz4)", cdr, in_mcap, 2},
           Row{open_mcap, "mcap/kitti0005_2frames_zstd.mcap", "MCAP (zstd)", cdr, in_mcap, 2},
       }) {
    check_recorded(row.open, row.path, row.format, row.topic,
                   {row.messages.begin(), row.messages.begin() + row.count});
  }
}

TEST_CASE("bags: recorded ones that are cut off give what is before the cut") {
  struct Row {
    Open open;
    const char* path;
    std::size_t size, messages;
    const char* expected;
  };
  const Open open_1 = io::ros::open_rosbag1, open_mcap = io::ros::open_mcap;
  const char *const bag_file = "formats/rosbag1/kitti0005_3frames_lz4.bag",
                    *const mcap_file = "formats/mcap/kitti0005_4frames_none.mcap";
  for (const Row& row : {
           // after the second chunk, the third chunk
           Row{open_1, bag_file, 3310493, 2, "byte 3310493, expected the index at byte"},
           Row{open_1, bag_file, 3000000, 1, "byte 3000000, inside the record at byte 1659632"},
           Row{open_mcap, mcap_file, 5907184, 3, "byte 5907184, expected a footer"},
           Row{open_mcap, mcap_file, 5907183, 2, "byte 5907183, inside the record at byte 3947315"},
       }) {
    const auto path = real_data(row.path);
    if (!path) return;
    std::string bytes = content_of(*path);
    bytes.resize(row.size);
    check_ends(row.open, bytes, row.messages, std::string("the file ends at ") + row.expected);
  }
}

TEST_CASE("bags: what is none") {
  const TemporaryFolder folder;
  const auto other = put(folder.path() / "x.bag", "# .PCD v0.7");
  CHECK(is_bag(other) == false);
  check_clear(refused(other), ErrorCode::corrupt_data, "x.bag", "expected a bag");
  const auto empty = put(folder.path() / "y.bag", "");
  CHECK(is_bag(empty) == false);
  check_clear(refused(empty), ErrorCode::corrupt_data, "y.bag", "the file is empty");
  CHECK(is_bag(folder.path()) == false);
  check_clear(refused(folder.path()), ErrorCode::not_found, folder.path().string(),
              "no .db3 or .mcap");
  const auto absent = is_bag(folder.path() / "z");
  REQUIRE_FALSE(absent.has_value());
  CHECK(absent.error().code == ErrorCode::not_found);
  CHECK(refused(folder.path() / "z").code == ErrorCode::not_found);
}

TEST_CASE("bags: the parts of a folder are read in natural order as one bag") {
  const TemporaryFolder folder;
  put(folder.path() / "metadata.yaml", "rosbag2_bagfile_information:");
  // /imu comes first in the second part: topics are matched by name.
  put(folder.path() / "bag_2.db3", rosbag2(some(0, 4)));
  put(folder.path() / "bag_10.mcap", mcap(some(4, 8)));
  put(folder.path() / "bag_11.db3", rosbag2({}));
  put(folder.path() / "bag_12.db3", rosbag2(some(8, 10)));
  CHECK(is_bag(folder.path()) == true);
  const auto opened = open_bag(folder.path());
  REQUIRE_MESSAGE(opened, to_string(opened.error()));
  io::ros::MessageReader& reader = **opened;
  CHECK(reader.format() == "rosbag2 (SQLite), 4 parts");
  REQUIRE(reader.topics().size() == 2);
  CHECK(reader.topics()[0].name == "/points");
  CHECK(reader.topics()[0].messages == 4);
  CHECK(reader.topics()[1].messages == 6);
  const auto all = in_order(two_topics());
  CHECK(reader.span() == std::optional(std::pair(all.front().log_time, all.back().log_time)));
  CHECK(read_on(reader).messages == all);
  CHECK(reader.file() == (folder.path() / "bag_12.db3").string());
  for (std::size_t i = 0; i < all.size(); ++i) {
    REQUIRE(reader.seek(all[i].log_time));
    CHECK(read_on(reader).messages ==
          std::vector(all.begin() + static_cast<std::ptrdiff_t>(i), all.end()));
  }
  REQUIRE(reader.select({0}));
  for (const ReadMessage& message : read_on(reader).messages) CHECK(message.topic == "/points");
  CHECK(reader.select({2}).error().code == ErrorCode::invalid_input);
}

TEST_CASE("bags: an error in a part names the part") {
  const TemporaryFolder folder;
  put(folder.path() / "bag_0.mcap", mcap(some(0, 4)));
  const std::string cut = mcap(some(4, 10));
  put(folder.path() / "bag_1.mcap", cut.substr(0, cut.size() / 2));
  const auto reader = open_bag(folder.path());
  REQUIRE_MESSAGE(reader, to_string(reader.error()));
  const Reading reading = read_on(**reader);
  CHECK(reading.messages.size() >= 4);
  REQUIRE(reading.ending.has_value());
  check_clear(*reading.ending, ErrorCode::corrupt_data, "bag_1.mcap", "the file ends at byte");
}

TEST_CASE("bags: parts that are compressed as files") {
  const TemporaryFolder folder;
  const std::string bag = rosbag2(samples());
  const auto part = put(folder.path() / "bag_0.db3.zstd", zstd_of(bag));
  CHECK(is_bag(folder.path()) == true);
  CHECK(is_bag(part) == true);
  check_clear(refused(folder.path()), ErrorCode::unsupported, "bag_0.db3.zstd", "zstd -d");
  check_clear(refused(part), ErrorCode::unsupported, "bag_0.db3.zstd", "zstd -d");
  const std::string name = "rosbag2_2024_05_17-11_42_03_of_the_northern_campus_0.db3.zstd";
  const TemporaryFolder other;
  put(other.path() / name, zstd_of(bag));
  check_clear(refused(other.path()), ErrorCode::unsupported, name, "`zstd -d '" + name + "'`");
  put(folder.path() / "bag_0.db3", bag);  // as zstd -d leaves it
  const auto reader = open_bag(folder.path());
  REQUIRE_MESSAGE(reader, to_string(reader.error()));
  CHECK(read_on(**reader).messages.size() == 10);
}

TEST_CASE("bags: recorded folders") {
  const auto folder = real_data("formats/rosbag2/kitti0005_3frames");
  if (!folder) return;
  CHECK(is_bag(*folder) == true);
  const auto reader = open_bag(*folder);
  REQUIRE_MESSAGE(reader, to_string(reader.error()));
  CHECK((*reader)->format() == "rosbag2 (SQLite)");
  CHECK(read_on(**reader).messages.size() == 3);
}

}  // namespace vantage::test
