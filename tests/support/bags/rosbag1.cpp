#include <algorithm>
#include <map>

#include "support/bags/bags.hpp"

namespace vantage::test {
namespace {

using Fields = std::vector<std::pair<std::string, std::string>>;

std::string op(std::uint8_t operation) { return little(operation); }
std::string time(std::int64_t log_time) {
  return little(static_cast<std::uint32_t>(log_time / 1'000'000'000)) +
         little(static_cast<std::uint32_t>(log_time % 1'000'000'000));
}
std::string fields_of(const Fields& fields) {
  std::string bytes;
  for (const auto& [name, value] : fields) bytes += sized(name + '=' + value);
  return bytes;
}

std::string connection(std::uint32_t number, const TestMessage& message) {
  return rosbag1_record({{"op", op(7)}, {"topic", message.topic}, {"conn", little(number)}},
                        fields_of({{"topic", message.topic},
                                   {"type", message.type},
                                   {"md5sum", "*"},
                                   {"message_definition", "uint8 x"}}));
}

std::string bag_header(std::uint64_t index, std::size_t connections, std::size_t chunks) {
  const Fields fields{{"op", op(3)},
                      {"index_pos", little(index)},
                      {"conn_count", little(static_cast<std::uint32_t>(connections))},
                      {"chunk_count", little(static_cast<std::uint32_t>(chunks))}};
  constexpr std::size_t kSize = 4096;
  return rosbag1_record(fields, std::string(kSize - 8 - fields_of(fields).size(), ' '));
}

}  // namespace

std::string rosbag1_record(const Fields& fields, std::string_view data) {
  return sized(fields_of(fields)) + sized(data);
}

std::string rosbag1(const std::vector<TestMessage>& messages, const Rosbag1Options& options) {
  const std::string magic = "#ROSBAG V2.0\n";
  const std::size_t begin = magic.size() + bag_header(0, 0, 0).size();
  std::map<std::string, std::uint32_t> numbers;
  std::string chunks, connections, infos;
  std::size_t chunk_count = 0;
  for (std::size_t first = 0; first < messages.size(); first += options.messages_in_chunk) {
    const std::size_t end = std::min(messages.size(), first + options.messages_in_chunk);
    std::string content;
    std::map<std::uint32_t, std::string> indices;  // of the messages of a connection
    std::int64_t earliest = messages[first].log_time, latest = earliest;
    for (std::size_t i = first; i < end; ++i) {
      const TestMessage& message = messages[i];
      const auto next = static_cast<std::uint32_t>(numbers.size());
      const auto [known, is_new] = numbers.emplace(message.topic, next);
      if (is_new) {
        content += connection(next, message);
        connections += connection(next, message);
      }
      indices[known->second] +=
          time(message.log_time) + little(static_cast<std::uint32_t>(content.size()));
      content += rosbag1_record(
          {{"op", op(2)}, {"conn", little(known->second)}, {"time", time(message.log_time)}},
          message.bytes);
      earliest = std::min(earliest, message.log_time);
      latest = std::max(latest, message.log_time);
    }
    const std::uint64_t place = begin + chunks.size();
    chunks += rosbag1_record({{"op", op(5)},
                              {"compression", options.compression},
                              {"size", little(static_cast<std::uint32_t>(content.size()))}},
                             packed(options.compression, content));
    std::string counts;
    for (const auto& [number, entries] : indices) {
      const auto count = static_cast<std::uint32_t>(entries.size() / 12);
      chunks += rosbag1_record({{"op", op(4)},
                                {"ver", little(std::uint32_t{1})},
                                {"conn", little(number)},
                                {"count", little(count)}},
                               entries);
      counts += little(number) + little(count);
    }
    infos += rosbag1_record({{"op", op(6)},
                             {"ver", little(std::uint32_t{1})},
                             {"chunk_pos", little(place)},
                             {"start_time", time(earliest)},
                             {"end_time", time(latest)},
                             {"count", little(static_cast<std::uint32_t>(indices.size()))}},
                            counts);
    ++chunk_count;
  }
  if (!options.indexed) return magic + bag_header(0, 0, 0) + chunks;
  return magic + bag_header(begin + chunks.size(), numbers.size(), chunk_count) + chunks +
         connections + infos;
}

}  // namespace vantage::test
