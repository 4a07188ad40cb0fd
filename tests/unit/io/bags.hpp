#pragma once

#include <doctest/doctest.h>

#include <cstdint>
#include <functional>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "files.hpp"
#include "io/ros/crc32.hpp"
#include "io/ros/message_reader.hpp"
#include "support/bags/bags.hpp"

namespace vantage::test {

using Reader = std::unique_ptr<io::ros::MessageReader>;
using Open = Result<Reader> (*)(io::InputFile);

struct ReadMessage {
  std::string topic;
  std::int64_t log_time = 0;
  std::string bytes;

  friend bool operator==(const ReadMessage&, const ReadMessage&) = default;
};
struct Reading {
  std::vector<ReadMessage> messages;
  std::optional<Error> ending;
};

inline Reading read_on(io::ros::MessageReader& reader) {
  Reading reading;
  for (;;) {
    auto message = reader.next();
    if (!message) {
      reading.ending = message.error();
      const auto again = reader.next();
      REQUIRE_FALSE(again.has_value());
      CHECK(again.error().message == message.error().message);
      return reading;
    }
    if (!*message) return reading;
    REQUIRE((*message)->topic < reader.topics().size());
    reading.messages.push_back({reader.topics()[(*message)->topic].name, (*message)->log_time,
                                std::string((*message)->bytes)});
  }
}

/// What a bag in memory gives, or why it cannot be opened.
inline Reading read_bytes(Open open, const std::string& bytes) {
  const auto reader = open(io::InputFile::of_memory(bytes, "test.bag"));
  if (!reader) return {{}, reader.error()};
  return read_on(**reader);
}

/// Checks that an error comes after `messages` messages, is clear and holds `expected`.
inline void check_ends(Open open, const std::string& bytes, std::size_t messages,
                       const std::string& expected, ErrorCode code = ErrorCode::corrupt_data) {
  const Reading reading = read_bytes(open, bytes);
  CAPTURE(expected);
  CHECK(reading.messages.size() == messages);
  REQUIRE(reading.ending.has_value());
  check_clear(*reading.ending, code, "test.bag", expected);
}

/// Messages of two topics, which are not in the order of their times within a chunk of two.
inline std::vector<TestMessage> two_topics(const std::string& cloud = "sensor_msgs/PointCloud2",
                                           const std::string& imu = "sensor_msgs/Imu") {
  std::vector<TestMessage> messages;
  for (int i = 0; i < 10; ++i) {
    const std::int64_t time = 1'600'000'000'000'000'000 + 100'000'000 * (i ^ 1);
    const bool is_cloud = i % 3 == 0;
    std::string bytes;
    for (int k = 0; k < 20 + 7 * i; ++k) bytes += static_cast<char>(k * k + i);
    messages.push_back({is_cloud ? "/points" : "/imu", is_cloud ? cloud : imu, time, bytes});
  }
  return messages;
}

inline std::vector<ReadMessage> in_order(const std::vector<TestMessage>& messages) {
  std::vector<ReadMessage> sorted;
  for (const TestMessage& message : messages) {
    sorted.push_back({message.topic, message.log_time, message.bytes});
  }
  std::stable_sort(sorted.begin(), sorted.end(),
                   [](const auto& a, const auto& b) { return a.log_time < b.log_time; });
  return sorted;
}

/// Checks what holds of every bag of two_topics().
inline void check_two_topics(Open open, const std::string& bytes, const std::string& format) {
  CAPTURE(format);
  const auto opened = open(io::InputFile::of_memory(bytes, "test.bag"));
  REQUIRE_MESSAGE(opened, to_string(opened.error()));
  io::ros::MessageReader& reader = **opened;
  CHECK(reader.format() == format);
  CHECK(reader.file() == "test.bag");
  REQUIRE(reader.topics().size() == 2);
  const std::size_t points = reader.topics()[0].name == "/points" ? 0 : 1;
  CHECK(reader.topics()[points].type == "sensor_msgs/PointCloud2");
  CHECK(reader.topics()[points].messages == 4);
  CHECK(reader.topics()[1 - points].name == "/imu");
  CHECK(reader.topics()[1 - points].type == "sensor_msgs/Imu");
  CHECK(reader.topics()[1 - points].messages == 6);
  const std::vector<ReadMessage> all = in_order(two_topics());
  REQUIRE(reader.span().has_value());
  CHECK(reader.span()->first == all.front().log_time);
  CHECK(reader.span()->second == all.back().log_time);

  const auto after = [&all](std::int64_t time, const std::string& topic) {
    std::vector<ReadMessage> wanted;
    for (const ReadMessage& message : all) {
      if (message.log_time >= time && (topic.empty() || message.topic == topic)) {
        wanted.push_back(message);
      }
    }
    return wanted;
  };
  CHECK(read_on(reader).messages == all);
  for (const ReadMessage& message : all) {
    for (const std::int64_t time : {message.log_time - 1, message.log_time, message.log_time + 1}) {
      REQUIRE(reader.seek(time));
      CHECK(read_on(reader).messages == after(time, ""));
    }
  }
  REQUIRE(reader.select({points}));
  CHECK(read_on(reader).messages == after(0, "/points"));
  for (const ReadMessage& message : all) {
    REQUIRE(reader.seek(message.log_time));
    CHECK(read_on(reader).messages == after(message.log_time, "/points"));
  }
  REQUIRE(reader.select({1 - points}));
  const Reading rest = read_on(reader);
  CHECK(rest.messages == after(0, "/imu"));
  CHECK_FALSE(rest.ending.has_value());
  REQUIRE(reader.select({}));
  CHECK(read_on(reader).messages.empty());
  const auto refused = reader.select({2});
  REQUIRE_FALSE(refused.has_value());
  CHECK(refused.error().code == ErrorCode::invalid_input);
}

/// Cuts a bag at every byte: what is given is a beginning of what the whole bag holds, an error
/// comes if messages are missing, and nearly all cuts leave the messages before them.
inline void check_cuts(Open open, const std::string& bytes, bool in_file_order) {
  std::vector<ReadMessage> all = in_order(two_topics());
  std::size_t most = 0;
  for (std::size_t size = 0; size < bytes.size(); ++size) {
    CAPTURE(size);
    const Reading reading = read_bytes(open, bytes.substr(0, size));
    most = std::max(most, reading.messages.size());
    REQUIRE(reading.messages.size() + (in_file_order ? 0 : 1) >= most);
    for (const ReadMessage& message : reading.messages) {
      REQUIRE(std::find(all.begin(), all.end(), message) != all.end());
    }
    if (reading.ending) {
      check_clear(*reading.ending, ErrorCode::corrupt_data, "test.bag", "");
    }
  }
  CHECK(most == all.size());
}

/// Flips bits: no crash, and messages or a clear error.
inline void check_flips(Open open, const std::string& bytes, std::size_t stride) {
  for (std::size_t at = 0; at < bytes.size(); at += stride) {
    for (const int flip : {0x01, 0x80, 0xFF}) {
      std::string damaged = bytes;
      damaged[at] = static_cast<char>(damaged[at] ^ flip);
      const Reading reading = read_bytes(open, damaged);
      if (!reading.ending) continue;
      CAPTURE(at);
      const std::string line = to_string(*reading.ending);
      CAPTURE(line);
      CHECK(line.size() < 400);
      CHECK(line.find("test.bag") != std::string::npos);
    }
  }
}

struct RecordedMessage {
  std::int64_t log_time = 0;
  std::size_t size = 0;
  std::uint32_t checksum = 0;  // CRC-32
};
/// Checks the only topic of a recorded bag.
inline void check_recorded(Open open, const std::string& path, const std::string& format,
                           const io::ros::Topic& topic,
                           const std::vector<RecordedMessage>& expected) {
  const auto file = real_data("formats/" + path);
  if (!file) return;
  CAPTURE(path);
  auto input = io::InputFile::open(*file, "a bag");
  REQUIRE(input.has_value());
  const auto reader = open(std::move(*input));
  REQUIRE_MESSAGE(reader, to_string(reader.error()));
  CHECK((*reader)->format() == format);
  REQUIRE((*reader)->topics().size() == 1);
  const io::ros::Topic& found = (*reader)->topics().front();
  CHECK(found.name == topic.name);
  CHECK(found.type == topic.type);
  CHECK(found.encoding == topic.encoding);
  CHECK(found.messages == expected.size());
  CHECK((*reader)->span() ==
        std::optional(std::pair(expected.front().log_time, expected.back().log_time)));
  const Reading reading = read_on(**reader);
  CHECK_FALSE(reading.ending.has_value());
  REQUIRE(reading.messages.size() == expected.size());
  for (std::size_t i = 0; i < expected.size(); ++i) {
    CHECK(reading.messages[i].log_time == expected[i].log_time);
    CHECK(reading.messages[i].bytes.size() == expected[i].size);
    CHECK(io::ros::crc32(reading.messages[i].bytes) == expected[i].checksum);
  }
}

/// Replaces the only place where `from` is.
inline std::string replaced(std::string bytes, const std::string& from, const std::string& to) {
  const std::size_t at = bytes.find(from);
  REQUIRE(at != std::string::npos);
  return bytes.replace(at, from.size(), to);
}

}  // namespace vantage::test
