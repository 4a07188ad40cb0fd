#include <sqlite3.h>

#include "bags.hpp"

namespace vantage::test {
namespace {

using io::ros::open_rosbag2_sqlite;

std::vector<TestMessage> samples() {
  return two_topics("sensor_msgs/msg/PointCloud2", "sensor_msgs/msg/Imu");
}

constexpr const char* kTopics =
    "CREATE TABLE topics(id INTEGER PRIMARY KEY, name, type, serialization_format);"
    "INSERT INTO topics VALUES(1, '/a', 't/msg/T', 'cdr');";
constexpr const char* kMessages =
    "CREATE TABLE messages(id INTEGER PRIMARY KEY, topic_id, timestamp, data);";

std::string with(const std::string& rows) { return sqlite_file(kTopics + (kMessages + rows)); }

}  // namespace

TEST_CASE("rosbag2: recorded bags") {
  check_recorded(open_rosbag2_sqlite, "rosbag2/kitti0005_3frames/kitti0005_3frames_0.db3",
                 "rosbag2 (SQLite)",
                 {"/points_raw", "sensor_msgs/PointCloud2", io::ros::Encoding::cdr, "cdr", {}},
                 {{1317037200000000000, 1974509, 0x804ba41b},
                  {1317037200100000000, 1971725, 0x96a9173d},
                  {1317037200200000000, 1959789, 0x910c9b2b}});
  check_recorded(
      open_rosbag2_sqlite, "rosbag2/nebula_vlp16/1673400471837873222_0.db3", "rosbag2 (SQLite)",
      {"/velodyne_packets", "velodyne_msgs/VelodyneScan", io::ros::Encoding::cdr, "cdr", {}},
      {{1673400471837873222, 183648, 0xb7a3cf84},
       {1673400471937957440, 183648, 0xe79bc7c8},
       {1673400472038371929, 183648, 0x4ea713da},
       {1673400472138016708, 182432, 0x64b96cff}});
}

TEST_CASE("rosbag2: topics, counts, order, selection and seeking") {
  check_two_topics(open_rosbag2_sqlite, rosbag2(samples()), "rosbag2 (SQLite)");
  check_two_topics(open_rosbag2_sqlite, rosbag2(samples(), {.timestamp_index = false}),
                   "rosbag2 (SQLite)");
  check_two_topics(open_rosbag2_sqlite, rosbag2(samples(), {.zstd = true}), "rosbag2 (SQLite)");
}

TEST_CASE("rosbag2: cuts and flipped bits") {
  const std::string bag = rosbag2(samples());
  for (std::size_t size = 1; size < bag.size(); size += 97) {
    const Reading reading = read_bytes(open_rosbag2_sqlite, bag.substr(0, size));
    REQUIRE(reading.ending.has_value());
    check_clear(*reading.ending, ErrorCode::corrupt_data, "test.bag", "");
  }
  check_flips(open_rosbag2_sqlite, bag, 13);
  check_flips(open_rosbag2_sqlite, rosbag2(samples(), {.zstd = true, .timestamp_index = false}),
              29);
}

TEST_CASE("rosbag2: what is not a rosbag2") {
  const auto refused = [](const std::string& bytes, const std::string& expected,
                          ErrorCode code = ErrorCode::corrupt_data) {
    check_ends(open_rosbag2_sqlite, bytes, 0, expected, code);
  };
  refused("no database at all...", "the file ends at byte 21, expected the 100 bytes");
  refused(std::string(4096, 'x'), "begins like no SQLite database");
  refused(sqlite_file("CREATE TABLE x(y)"), "there is no table 'topics'");
  refused(sqlite_file(kTopics), "there is no table 'messages'");
  refused(sqlite_file(std::string("CREATE TABLE topics(id, name, type);") + kMessages),
          "no stored column 'serialization_format'");
  refused(sqlite_file(std::string(kTopics) + "CREATE TABLE messages(id, topic_id, data)"),
          "no stored column 'timestamp'");
  refused(sqlite_file(std::string(kTopics) +
                      "CREATE VIEW messages AS WITH RECURSIVE n(id) AS "
                      "(SELECT 1 UNION ALL SELECT id + 1 FROM n) SELECT id, 1 AS topic_id, "
                      "id AS timestamp, x'00' AS data FROM n"),
          "'messages' is 'view', expected an ordinary table");
  refused(
      sqlite_file(std::string(kTopics) + "CREATE TABLE messages(id INTEGER PRIMARY KEY, topic_id, "
                                         "timestamp, data AS (zeroblob(1000000000)))"),
      "no stored column 'data'");
  refused(
      sqlite_file(std::string(kTopics) + "CREATE TABLE messages(id INTEGER PRIMARY KEY, topic_id, "
                                         "timestamp, data) WITHOUT ROWID"),
      "SQLite says: no such column: rowid");
  refused(rosbag2(samples(), {.serialization = "protobuf"}),
          "serialized as 'protobuf', expected 'cdr'", ErrorCode::unsupported);
  refused(sqlite_file(std::string("CREATE TABLE topics(id INTEGER PRIMARY KEY, name, type, "
                                  "serialization_format);") +
                      kMessages),
          "the bag has no topic");
}

TEST_CASE("rosbag2: rows of other types") {
  check_ends(open_rosbag2_sqlite, with("INSERT INTO messages VALUES(1, 1, 'noon', x'00')"), 0,
             "message 1 has a topic_id or a timestamp that is not a whole number");
  check_ends(open_rosbag2_sqlite, with("INSERT INTO messages VALUES(1, NULL, 5, x'00')"), 0,
             "not a whole number");
  check_ends(open_rosbag2_sqlite, with("INSERT INTO messages VALUES(4, 9, 5, x'00')"), 0,
             "message 4 has the topic_id 9");
  check_ends(open_rosbag2_sqlite,
             with("INSERT INTO messages VALUES(1, 1, 5, x'00'), (2, 1, 6, 'text')"), 1,
             "message 2 has data that is not a blob");
  check_ends(open_rosbag2_sqlite, with("INSERT INTO messages VALUES(1, 1, 5, x'28B52FFD0000')"), 0,
             "message 1 cannot be decompressed");
  check_ends(open_rosbag2_sqlite, with("INSERT INTO topics VALUES(2, x'00', 't/msg/T', 'cdr')"), 0,
             "row 2 of table 'topics'");
  CHECK(read_bytes(open_rosbag2_sqlite, with("INSERT INTO messages VALUES(1, 1, 5, x'')"))
            .messages.size() == 1);
}

TEST_CASE("rosbag2: SQLite's words about a damaged schema stay one line") {
  std::string bag = replaced(rosbag2(samples()), "CREATE INDEX", "CREATE INDEC");
  for (std::size_t at; (at = bag.find("timestamp_idx")) != std::string::npos;) bag[at + 4] = '\n';
  check_ends(open_rosbag2_sqlite, bag, 0, "malformed database schema");
}

TEST_CASE("rosbag2: a message that grows without measure is given up") {
  const auto grown = [](std::size_t size) {
    return rosbag2({{"/a", "t/msg/T", 1, std::string(size, '\0')}}, {.zstd = true});
  };
  constexpr std::size_t kMost = 64 << 20;
  const Reading most = read_bytes(open_rosbag2_sqlite, grown(kMost));
  REQUIRE(most.messages.size() == 1);
  CHECK(most.messages.front().bytes.size() == kMost);
  const std::string bag = grown(kMost + 1);
  CHECK(bag.size() < 64 << 10);
  check_ends(open_rosbag2_sqlite, bag, 0, "gives more than 67108864 bytes");
}

TEST_CASE("rosbag2: messages that together grow without measure are given up") {
  std::vector<TestMessage> messages(6, {"/a", "t/msg/T", 1, std::string(63 << 20, '\0')});
  const std::string bag = rosbag2(messages, {.zstd = true});
  check_ends(open_rosbag2_sqlite, bag, 4, "the messages to 5 give 330301440 bytes");
}

TEST_CASE(
    "rosbag2: a bag under a name that a URI must escape is read, and nothing written beside it") {
  const TemporaryFolder folder;
  const auto path = put(folder.path() / "a b%41?c#d.db3", rosbag2(samples()));
  auto input = io::InputFile::open(path, "a bag");
  REQUIRE(input.has_value());
  const auto reader = open_rosbag2_sqlite(std::move(*input));
  REQUIRE_MESSAGE(reader, to_string(reader.error()));
  CHECK(read_on(**reader).messages == in_order(two_topics()));
  CHECK(std::distance(std::filesystem::directory_iterator(folder.path()), {}) == 1);
}

TEST_CASE("rosbag2: a bag whose path begins with two slashes") {
  const TemporaryFolder folder;
  const auto path = put(folder.path() / "a.db3", rosbag2(samples()));
  auto input = io::InputFile::open("/" + path.string(), "a bag");
  REQUIRE(input.has_value());
  const auto reader = open_rosbag2_sqlite(std::move(*input));
  REQUIRE_MESSAGE(reader, to_string(reader.error()));
  CHECK(read_on(**reader).messages == in_order(two_topics()));
}

TEST_CASE("rosbag2: a bag whose recorder used a write-ahead log") {
  const TemporaryFolder folder;
  const auto path = folder.path() / "wal.db3";
  sqlite3* database = nullptr;
  REQUIRE(sqlite3_open(path.c_str(), &database) == SQLITE_OK);
  const std::string statements = std::string("PRAGMA journal_mode = WAL;") + kTopics + kMessages +
                                 "INSERT INTO messages VALUES(1, 1, 5, x'00');";
  REQUIRE(sqlite3_exec(database, statements.c_str(), nullptr, nullptr, nullptr) == SQLITE_OK);
  {  // The recorder is still there, or was killed: the rows are in the log.
    const auto reader = io::ros::open_bag(path);
    REQUIRE_FALSE(reader.has_value());
    check_clear(reader.error(), ErrorCode::unsupported, "wal.db3", "of the same name and -wal");
  }
  sqlite3_close(database);  // takes them in
  const auto reader = io::ros::open_bag(path);
  REQUIRE_MESSAGE(reader, to_string(reader.error()));
  CHECK(read_on(**reader).messages.size() == 1);
  CHECK(std::distance(std::filesystem::directory_iterator(folder.path()), {}) == 1);
}

}  // namespace vantage::test
