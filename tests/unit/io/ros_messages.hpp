#pragma once

#include <doctest/doctest.h>

#include <algorithm>
#include <array>
#include <cstdint>
#include <limits>
#include <map>
#include <memory>
#include <optional>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "files.hpp"
#include "io/ros/message_reader.hpp"

namespace vantage::test {

using io::ros::Encoding;

/// Writes messages, independently of what reads them.
class MessageWriter {
 public:
  enum class Layout { ros1, cdr_little, cdr_big };

  explicit MessageWriter(Layout layout) : layout_(layout) {
    if (layout == Layout::cdr_little) bytes_ = std::string("\0\1\0\0", 4);
    if (layout == Layout::cdr_big) bytes_ = std::string("\0\0\0\0", 4);
  }

  template <class T>
  MessageWriter& number(T value) {
    if (layout_ != Layout::ros1) {
      while (bytes_.size() % sizeof(T) != 4 % sizeof(T)) bytes_ += '\0';
    }
    bytes_ += layout_ == Layout::cdr_big ? reversed(value) : raw(value);
    return *this;
  }
  MessageWriter& text(const std::string& value) {
    const std::string stored = layout_ == Layout::ros1 ? value : value + '\0';
    number(static_cast<std::uint32_t>(stored.size()));
    return append(stored);
  }
  MessageWriter& append(const std::string& bytes) {
    bytes_ += bytes;
    return *this;
  }
  MessageWriter& time(std::uint32_t seconds, std::uint32_t nanoseconds) {
    return number(seconds).number(nanoseconds);
  }
  MessageWriter& header(std::uint32_t seconds, std::uint32_t nanoseconds,
                        const std::string& frame) {
    if (layout_ == Layout::ros1) number(std::uint32_t{4711});  // seq
    return time(seconds, nanoseconds).text(frame);
  }
  template <std::size_t n>
  MessageWriter& numbers(const std::array<double, n>& values) {
    for (const double value : values) number(value);
    return *this;
  }

  [[nodiscard]] const std::string& bytes() const { return bytes_; }
  [[nodiscard]] Encoding encoding() const {
    return layout_ == Layout::ros1 ? Encoding::ros1 : Encoding::cdr;
  }

 private:
  Layout layout_;
  std::string bytes_;
};

inline constexpr std::array<MessageWriter::Layout, 3> kLayouts{
    MessageWriter::Layout::ros1, MessageWriter::Layout::cdr_little, MessageWriter::Layout::cdr_big};

/// A bag in memory that counts what is read of it.
class MemoryBag final : public io::ros::MessageReader {
 public:
  struct Message {
    std::size_t topic = 0;
    std::int64_t log_time = 0;  // [ns]
    std::string bytes;
  };

  MemoryBag(std::vector<io::ros::Topic> topics, std::vector<Message> messages)
      : topics_(std::move(topics)), messages_(std::move(messages)) {
    for (std::size_t i = 0; i < topics_.size(); ++i) selected_.push_back(i);
  }

  [[nodiscard]] const std::string& format() const override { return format_; }
  [[nodiscard]] const std::string& file() const override { return file_; }
  [[nodiscard]] const std::vector<io::ros::Topic>& topics() const override { return topics_; }
  [[nodiscard]] std::optional<std::pair<std::int64_t, std::int64_t>> span() const override {
    return std::nullopt;
  }
  [[nodiscard]] Result<void> select(const std::vector<std::size_t>& topics) override {
    selected_ = topics;
    at_ = 0;
    return {};
  }
  [[nodiscard]] Result<std::optional<io::ros::BagMessage>> next() override {
    ++reads;
    current_.assign(current_.size(), '?');  // what was given before is no longer valid
    for (; at_ < messages_.size(); ++at_) {
      const Message& message = messages_[at_];
      if (std::find(selected_.begin(), selected_.end(), message.topic) == selected_.end()) continue;
      current_ = message.bytes;
      const std::uint64_t offset = 1000 * ++at_;
      return io::ros::BagMessage{message.topic, message.log_time, current_, offset};
    }
    return std::nullopt;
  }
  [[nodiscard]] Result<void> seek(std::int64_t log_time) override {
    at_ = 0;
    while (at_ < messages_.size() && messages_[at_].log_time < log_time) ++at_;
    return {};
  }

  std::size_t reads = 0;

 private:
  std::vector<io::ros::Topic> topics_;
  std::vector<Message> messages_;
  std::vector<std::size_t> selected_;
  std::size_t at_ = 0;
  std::string format_ = "memory", file_ = "run.bag", current_;
};

}  // namespace vantage::test
