#include <algorithm>
#include <map>

#include "support/bags/bags.hpp"

namespace vantage::test {
namespace {

std::uint32_t checksum(std::string_view bytes) {
  std::uint32_t sum = 0xFFFFFFFFU;
  for (const char c : bytes) {
    sum ^= static_cast<unsigned char>(c);
    for (int bit = 0; bit < 8; ++bit) sum = (sum >> 1) ^ ((sum & 1) != 0 ? 0xEDB88320U : 0U);
  }
  return ~sum;
}

std::string message_record(std::uint16_t channel, const TestMessage& message) {
  const auto time = little(static_cast<std::uint64_t>(message.log_time));
  return mcap_record(0x05,
                     little(channel) + little(std::uint32_t{0}) + time + time + message.bytes);
}

/// What the summary says again.
struct Summary {
  std::string channels;  // and schemas
  std::string chunk_indexes;
  std::uint32_t chunks = 0;
  std::map<std::uint16_t, std::uint64_t> messages;
};

std::string statistics(const Summary& summary, std::size_t messages) {
  std::string counts;
  for (const auto& [channel, count] : summary.messages) counts += little(channel) + little(count);
  const auto channels = static_cast<std::uint32_t>(summary.messages.size());
  return mcap_record(0x0B, little(std::uint64_t{messages}) +
                               little(static_cast<std::uint16_t>(channels)) + little(channels) +
                               little(std::uint64_t{0}) + little(summary.chunks) +
                               little(std::uint64_t{0}) + little(std::uint64_t{0}) + sized(counts));
}

}  // namespace

std::string mcap_record(std::uint8_t opcode, std::string_view body) {
  return little(opcode) + little(std::uint64_t{body.size()}) + std::string(body);
}

std::string mcap(const std::vector<TestMessage>& messages, const McapOptions& options) {
  const std::string magic("\x89MCAP0\r\n", 8);
  std::string file = magic + mcap_record(0x01, sized("ros2") + sized("test"));
  Summary summary;
  std::map<std::string, std::uint16_t> numbers;
  for (std::size_t first = 0; first < messages.size(); first += options.messages_in_chunk) {
    const std::size_t end = std::min(messages.size(), first + options.messages_in_chunk);
    std::string content;
    std::map<std::uint16_t, std::string> indices;  // of the messages of a channel
    auto earliest = static_cast<std::uint64_t>(messages[first].log_time), latest = earliest;
    for (std::size_t i = first; i < end; ++i) {
      const TestMessage& message = messages[i];
      const auto next = static_cast<std::uint16_t>(numbers.size() + 1);
      const auto [known, is_new] = numbers.emplace(message.topic, next);
      if (is_new) {
        const std::string records =
            mcap_record(0x03, little(next) + sized(message.type) + sized("ros2msg") + sized("")) +
            mcap_record(0x04, little(next) + little(next) + sized(message.topic) +
                                  sized(options.encoding) + sized(""));
        content += records;
        summary.channels += records;
      }
      const auto time = static_cast<std::uint64_t>(message.log_time);
      indices[known->second] += little(time) + little(std::uint64_t{content.size()});
      content += message_record(known->second, message);
      ++summary.messages[known->second];
      earliest = std::min(earliest, time);
      latest = std::max(latest, time);
    }
    if (!options.chunked) {
      file += content;
      continue;
    }
    const std::uint64_t place = file.size();
    const std::string records = packed(options.compression, content);
    file += mcap_record(0x06, little(earliest) + little(latest) +
                                  little(std::uint64_t{content.size()}) +
                                  little(checksum(content)) + sized(options.compression) +
                                  little(std::uint64_t{records.size()}) + records);
    const std::uint64_t index_place = file.size();
    std::string offsets;
    for (const auto& [channel, entries] : indices) {
      offsets += little(channel) + little(std::uint64_t{file.size()});
      file += mcap_record(0x07, little(channel) + sized(entries));
    }
    summary.chunk_indexes += mcap_record(
        0x08, little(earliest) + little(latest) + little(place) + little(index_place - place) +
                  sized(offsets) + little(file.size() - index_place) + sized(options.compression) +
                  little(std::uint64_t{records.size()}) + little(std::uint64_t{content.size()}));
    ++summary.chunks;
  }
  file += mcap_record(0x0F, little(std::uint32_t{0}));
  const std::uint64_t summary_place = options.indexed ? file.size() : 0;
  std::string end;
  if (options.indexed) {
    end = summary.channels + statistics(summary, messages.size()) + summary.chunk_indexes;
  }
  end += little(std::uint8_t{0x02}) + little(std::uint64_t{20}) + little(summary_place) +
         little(std::uint64_t{0});
  return file + end + little(options.indexed ? checksum(end) : 0) + magic;
}

}  // namespace vantage::test
