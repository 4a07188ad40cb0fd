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
#include "support/bags/message_writer.hpp"

namespace vantage::test {

using io::ros::Encoding;

inline Encoding encoding_of(MessageWriter::Layout layout) {
  return layout == MessageWriter::Layout::ros1 ? Encoding::ros1 : Encoding::cdr;
}

/// Where messages of tests come from.
inline const SourceLocation kWhere{"run.bag", 0, 0};

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
