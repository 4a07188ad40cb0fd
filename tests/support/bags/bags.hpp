#pragma once

#include <cstddef>
#include <cstdint>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

// Small bags for tests, whole as bytes: what writes them shares nothing with what reads them.

namespace vantage::test {

struct TestMessage {
  std::string topic;          ///< "/points_raw"
  std::string type;           ///< "sensor_msgs/PointCloud2", spelled as the bag is to have it
  std::int64_t log_time = 0;  ///< [ns]
  std::string bytes;
};

struct Rosbag1Options {
  std::string compression = "none";  ///< or "bz2", "lz4"
  bool indexed = true;               ///< false: as a recorder leaves it that was cut off
  std::size_t messages_in_chunk = 2;
};
/// rosbag1 2.0. Every topic has one connection.
[[nodiscard]] std::string rosbag1(const std::vector<TestMessage>& messages,
                                  const Rosbag1Options& options = {});
/// "name=value" fields after their sizes, then the data after its size.
[[nodiscard]] std::string rosbag1_record(
    const std::vector<std::pair<std::string, std::string>>& fields, std::string_view data);

struct Rosbag2Options {
  bool zstd = false;  ///< each message compressed
  bool timestamp_index = true;
  std::string serialization = "cdr";
};
/// A rosbag2 in SQLite, its rows in the order of the messages.
[[nodiscard]] std::string rosbag2(const std::vector<TestMessage>& messages,
                                  const Rosbag2Options& options = {});
/// A database file that these statements make.
[[nodiscard]] std::string sqlite_file(const std::string& statements);

struct McapOptions {
  std::string compression = "";  ///< of the chunks; or "lz4", "zstd"
  bool chunked = true;
  bool indexed = true;  ///< with a summary
  std::string encoding = "cdr";
  std::size_t messages_in_chunk = 2;
};
/// Every topic has one channel and one schema.
[[nodiscard]] std::string mcap(const std::vector<TestMessage>& messages,
                               const McapOptions& options = {});
/// An opcode, the size of the body and the body.
[[nodiscard]] std::string mcap_record(std::uint8_t opcode, std::string_view body);

/// The bytes of a value, little endian.
template <class T>
[[nodiscard]] std::string little(T value) {
  return {reinterpret_cast<const char*>(&value), sizeof(T)};
}
/// Bytes after their number in 32 bits.
[[nodiscard]] std::string sized(std::string_view bytes);

[[nodiscard]] std::string bz2_of(std::string_view bytes);
/// One frame of LZ4.
[[nodiscard]] std::string lz4_of(std::string_view bytes);
[[nodiscard]] std::string zstd_of(std::string_view bytes);
/// @param compression  bz2, lz4 or zstd; with any other name the bytes stay as they are
[[nodiscard]] std::string packed(const std::string& compression, const std::string& bytes);

}  // namespace vantage::test
