#pragma once

#include <filesystem>
#include <map>
#include <string>
#include <vector>

#include "io/ros/mcap_writer.hpp"

namespace vantage::test {

struct McapMessage {
  std::string topic;
  io::ros::MessageSchema schema;
  double stamp = 0.0;  ///< [s]
  std::string bytes;   ///< CDR, with its header
};

/// An MCAP file of these messages, in this order; a topic has the schema of its first message.
[[nodiscard]] inline Result<void> write_mcap(
    const std::filesystem::path& path, const std::vector<McapMessage>& messages,
    io::ros::McapCompression compression = io::ros::McapCompression::zstd) {
  VANTAGE_TRY(auto writer, io::ros::McapWriter::create(path, compression));
  std::map<std::string, io::ros::McapWriter::ChannelId> channels;
  for (const McapMessage& message : messages) {
    if (!channels.contains(message.topic)) {
      VANTAGE_TRY(channels[message.topic], writer.add_channel(message.topic, message.schema));
    }
    VANTAGE_CHECK(writer.write(channels[message.topic], message.stamp, message.bytes));
  }
  return writer.commit();
}

}  // namespace vantage::test
