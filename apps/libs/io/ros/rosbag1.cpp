#include <fmt/format.h>

#include <algorithm>
#include <limits>
#include <unordered_map>

#include "io/ros/bag_readers.hpp"
#include "io/ros/chunked_reader.hpp"
#include "io/ros/rosbag1_records.hpp"
#include "io/text.hpp"
#include "vantage/kit/byte_io.hpp"

namespace vantage::io::ros {
namespace {

using namespace rosbag1;

class Rosbag1Reader final : public ChunkedReader {
 public:
  explicit Rosbag1Reader(InputFile file) noexcept : ChunkedReader(std::move(file)) {}

  [[nodiscard]] Result<void> open() {
    VANTAGE_CHECK(read_bag_header());
    Result<void> index;
    if (index_offset_ != 0) {
      index = read_index();
      if (!index && index.error().code != ErrorCode::corrupt_data) return index;
    }
    const bool is_indexed = index_offset_ != 0 && index;
    if (!is_indexed) {
      start_over();
      connections_.clear();
      auto walked = walk();
      if (!walked && walked.error().code == ErrorCode::io_failure) return walked;
      if (!walked)
        end_with(std::move(walked).error());
      else if (!index)
        end_with(std::move(index).error());
    }
    finish(fmt::format("rosbag1 2.0{}{}", in_brackets(compression_),
                       is_indexed ? "" : ", not indexed"),
           !is_indexed);
    return {};
  }

 private:
  [[nodiscard]] Result<void> load_record(const Chunk& chunk, Content& content) override {
    VANTAGE_TRY(const RecordHead head, head_at(chunk.offset));
    if (head.operation != kChunk) return unexpected(chunk.offset, head.operation, "a chunk (5)");
    VANTAGE_TRY(const Packed packed, packed_in(chunk.offset, head));
    return unpack(chunk, packed, content);
  }

  [[nodiscard]] Result<Packed> packed_in(std::uint64_t offset, const RecordHead& head) const {
    const auto name = head.fields.text("compression");
    const auto size = head.fields.integer<std::uint32_t>("size");
    if (!name || !size) {
      return damaged(
          fmt::format("the chunk at byte {} has no compression or no size of 4 bytes", offset));
    }
    Packed packed;
    VANTAGE_TRY(packed.compression, compression(*name, offset));
    packed.offset = offset + head.data_offset;
    packed.size = head.data_size;
    packed.unpacked = *size;
    return packed;
  }

  /// Finds connections and messages in the content of a chunk.
  [[nodiscard]] Result<void> take_apart(const Chunk& chunk, Content& content) override {
    std::size_t at = 0;
    while (at < content.bytes.size()) {
      const auto here = [&content, at] { return place(content, at); };
      RecordHead head;
      const std::string_view rest = content.bytes.substr(at);
      const Reading reading = read_head(rest, head);
      if (reading == Reading::damaged) {
        return damaged(fmt::format("expected a record at {}", here()));
      }
      if (reading == Reading::cut || head.size() > rest.size()) {
        if (chunk.is_cut) return {};
        return damaged(fmt::format("the record at {} goes on after the chunk's end", here()));
      }
      const auto data = rest.substr(static_cast<std::size_t>(head.data_offset),
                                    static_cast<std::size_t>(head.data_size));
      if (head.operation == kConnection) {
        VANTAGE_CHECK(add_connection(head.fields, data, here()));
      } else if (head.operation == kMessage) {
        VANTAGE_TRY(Message message, message_of(head.fields, here));
        message.offset = at + head.data_offset;
        message.size = head.data_size;
        content.messages.push_back(message);
      } else {
        return damaged(
            fmt::format("a record with op {} at {}, expected a message (2) or a connection (7)",
                        head.operation, here()));
      }
      at += static_cast<std::size_t>(head.size());
    }
    return {};
  }

  /// @param place  std::string(); made only when it is needed
  template <class Place>
  [[nodiscard]] Result<Message> message_of(const Fields& fields, const Place& place) const {
    const auto connection = fields.integer<std::uint32_t>("conn");
    const auto time = fields.time("time");
    if (!connection || !time) {
      return damaged(
          fmt::format("the message at {} has no conn of 4 or no time of 8 bytes", place()));
    }
    const auto known = connections_.find(*connection);
    if (known == connections_.end()) {
      return damaged(fmt::format("the message at {} is of connection {}, which is not there",
                                 place(), *connection));
    }
    Message message;
    message.topic = known->second;
    message.log_time = *time;
    return message;
  }

  [[nodiscard]] Result<void> add_connection(const Fields& fields, std::string_view data,
                                            const std::string& place) {
    const auto number = fields.integer<std::uint32_t>("conn");
    const auto name = fields.text("topic");
    const auto described = Fields::parse(data);
    const auto type = described ? described->text("type") : std::nullopt;
    if (!number || !name || !type) {
      return damaged(
          fmt::format("the connection at {} has no conn of 4 bytes, no topic or no type", place));
    }
    Topic described_topic;
    described_topic.name = *name;
    described_topic.type = *type;
    described_topic.encoding = Encoding::ros1;
    described_topic.encoding_name = "ros1";
    VANTAGE_TRY(const std::uint32_t index, topic(described_topic));
    const auto [known, is_new] = connections_.emplace(*number, index);
    if (!is_new && known->second != index) {
      return damaged(
          fmt::format("the connection at {} is number {}, which is that of another "
                      "topic: {} is not {}",
                      place, *number, io::quoted(*name), io::quoted(topics()[known->second].name)));
    }
    return {};
  }

  /// The head of a record; `cut` says that the file ends within the head.
  [[nodiscard]] Result<std::pair<Reading, RecordHead>> look_at(std::uint64_t offset) {
    constexpr std::uint64_t kLargestHeader = 1 << 20;
    VANTAGE_TRY(std::string_view bytes, window().view(offset, 4));
    const std::uint64_t header = ByteReader(bytes).number<std::uint32_t>();
    std::pair<Reading, RecordHead> found;
    if (header > kLargestHeader) {
      found.first = Reading::damaged;
      return found;
    }
    VANTAGE_TRY(bytes, window().view(offset, 8 + header));
    found.first = read_head(bytes, found.second);
    return found;
  }
  /// The head of a record. Its fields are valid until the next call.
  [[nodiscard]] Result<RecordHead> head_at(std::uint64_t offset) {
    VANTAGE_TRY(const auto found, look_at(offset));
    if (found.first == Reading::cut) return cut(offset);
    if (found.first == Reading::damaged) {
      return damaged(fmt::format("expected a record at byte {}", offset));
    }
    return found.second;
  }
  [[nodiscard]] tl::unexpected<Error> cut(std::uint64_t offset) const {
    return damaged(fmt::format("the file ends at byte {}, inside the record at byte {}",
                               input().size(), offset));
  }
  [[nodiscard]] tl::unexpected<Error> unexpected(std::uint64_t offset, std::uint8_t operation,
                                                 std::string_view expected) const {
    return damaged(
        fmt::format("a record with op {} at byte {}, expected {}", operation, offset, expected));
  }

  [[nodiscard]] Result<void> read_bag_header() {
    VANTAGE_TRY(const std::string_view magic, window().view(0, kMagic.size()));
    if (magic != kMagic && kMagic.starts_with(magic)) return cut(0);
    if (magic != kMagic) {
      const auto code =
          looks_like_rosbag1(magic) ? ErrorCode::unsupported : ErrorCode::corrupt_data;
      return fail(code,
                  fmt::format("begins with {}, expected \"#ROSBAG V2.0\"; `rosbag fix` "
                              "converts older bags",
                              io::quoted(magic.substr(0, magic.find('\n')))),
                  SourceLocation{file(), 0, 0});
    }
    VANTAGE_TRY(const RecordHead head, head_at(kMagic.size()));
    if (head.operation != kBagHeader) {
      return unexpected(kMagic.size(), head.operation, "the bag header (3)");
    }
    if (!head.fields.text("encryptor").value_or("").empty()) {
      return fail(ErrorCode::unsupported,
                  fmt::format("the bag is encrypted ({}), expected one that is not",
                              io::quoted(*head.fields.text("encryptor"))),
                  SourceLocation{file(), 0, 0});
    }
    const auto index = head.fields.integer<std::uint64_t>("index_pos");
    const auto connections = head.fields.integer<std::uint32_t>("conn_count");
    const auto chunks = head.fields.integer<std::uint32_t>("chunk_count");
    if (!index || !connections || !chunks) {
      return damaged(
          fmt::format("the bag header at byte {} has no index_pos of 8 bytes, conn_count "
                      "or chunk_count of 4",
                      kMagic.size()));
    }
    index_offset_ = *index;
    stated_connections_ = *connections;
    stated_chunks_ = *chunks;
    records_offset_ = kMagic.size() + head.size();
    return {};
  }

  /// The connections and chunk infos at the end of a bag that was closed.
  [[nodiscard]] Result<void> read_index() {
    constexpr std::uint64_t kLargestIndexRecord = std::uint64_t{1} << 26;
    if (index_offset_ < records_offset_ || index_offset_ > input().size()) {
      return damaged(fmt::format("the file ends at byte {}, expected the index at byte {}",
                                 input().size(), index_offset_));
    }
    std::uint64_t at = index_offset_, connections = 0, chunks = 0;
    std::vector<std::uint64_t> offsets;
    while (at < input().size()) {
      VANTAGE_TRY(RecordHead head, head_at(at));
      if (head.size() > input().size() - at) return cut(at);
      if (head.data_size > kLargestIndexRecord) {
        return damaged(fmt::format("the record at byte {} claims {} bytes, expected at most {}", at,
                                   head.data_size, kLargestIndexRecord));
      }
      VANTAGE_TRY(const std::string_view bytes, window().view(at, head.size()));
      if (read_head(bytes, head) != Reading::good) return cut(at);
      const auto data = bytes.substr(static_cast<std::size_t>(head.data_offset));
      if (head.operation == kConnection) {
        ++connections;
        VANTAGE_CHECK(add_connection(head.fields, data, fmt::format("byte {}", at)));
      } else if (head.operation == kChunkInfo) {
        ++chunks;
        VANTAGE_CHECK(add_chunk(head.fields, data, at));
        offsets.push_back(*head.fields.integer<std::uint64_t>("chunk_pos"));
      } else {
        return unexpected(at, head.operation, "a connection (7) or a chunk info (6)");
      }
      at += head.size();
    }
    if (connections != stated_connections_ || chunks != stated_chunks_) {
      return damaged(
          fmt::format("the index at byte {} has {} connections and {} chunks, the bag "
                      "header says {} and {}",
                      index_offset_, connections, chunks, stated_connections_, stated_chunks_));
    }
    std::sort(offsets.begin(), offsets.end());
    const auto twice = std::adjacent_find(offsets.begin(), offsets.end());
    if (twice != offsets.end()) {
      return damaged(fmt::format("the index at byte {} has the chunk at byte {} twice",
                                 index_offset_, *twice));
    }
    if (!offsets.empty()) VANTAGE_CHECK(name_compression(offsets.front()));
    counted_.resize(topics().size());
    for (std::uint32_t i = 0; i < counted_.size(); ++i) count(i, counted_[i]);
    return {};
  }

  [[nodiscard]] Result<void> add_chunk(const Fields& fields, std::string_view data,
                                       std::uint64_t at) {
    const auto offset = fields.integer<std::uint64_t>("chunk_pos");
    const auto first = fields.time("start_time"), last = fields.time("end_time");
    const auto entries = fields.integer<std::uint32_t>("count");
    if (!offset || !first || !last || !entries || data.size() != std::uint64_t{8} * *entries) {
      return damaged(
          fmt::format("the chunk info at byte {} has no chunk_pos, start_time, end_time "
                      "or count, or not 8 bytes for each of its count",
                      at));
    }
    if (*offset < records_offset_ || *offset >= index_offset_) {
      return damaged(
          fmt::format("the chunk info at byte {} names a chunk at byte {}, expected {} "
                      "to {}",
                      at, *offset, records_offset_, index_offset_));
    }
    Chunk chunk;
    chunk.offset = *offset;
    chunk.first = *first;
    chunk.last = *last;
    chunk.messages = 0;
    chunk.topics.emplace();
    ByteReader reader(data);
    while (reader.left() != 0) {
      const auto known = connections_.find(reader.number<std::uint32_t>());
      const std::uint64_t messages = reader.number<std::uint32_t>();
      if (messages == 0) continue;
      if (known == connections_.end()) {
        return damaged(
            fmt::format("the chunk info at byte {} counts messages of a connection that "
                        "is not there",
                        at));
      }
      *chunk.messages += messages;
      counted_.resize(topics().size());
      counted_[known->second] += messages;
      chunk.topics->push_back(known->second);
    }
    if (*chunk.messages == 0) return {};
    std::sort(chunk.topics->begin(), chunk.topics->end());
    keep(std::move(chunk));
    return {};
  }

  [[nodiscard]] Result<void> name_compression(std::uint64_t offset) {
    VANTAGE_TRY(const RecordHead head, head_at(offset));
    compression_ = head.fields.text("compression").value_or("none");
    return {};
  }

  /// Reads all records of a bag that was not closed, or whose index is damaged.
  [[nodiscard]] Result<void> walk() {
    compression_.clear();
    Chunk run;  // of connections and messages outside of chunks
    run.is_record = false;
    std::uint64_t at = records_offset_;
    while (at < input().size()) {
      const auto head = head_at(at);
      if (!head || head->size() > input().size() - at) {
        VANTAGE_CHECK(end_run(run));
        if (!head) return fail(head.error());
        if (head->operation != kChunk) return cut(at);
      }
      const std::uint64_t end = at + head->size();
      switch (head->operation) {
        case kMessage:
        case kConnection:
          if (run.size == 0) run.offset = at;
          run.size = end - run.offset;
          if (run.size >= kLargestRun) VANTAGE_CHECK(end_run(run));
          break;
        case kChunk:
          VANTAGE_CHECK(end_run(run));
          VANTAGE_CHECK(walk_chunk(at));
          break;
        case kIndexData:
        case kChunkInfo: VANTAGE_CHECK(end_run(run)); break;
        default: {
          const std::uint8_t operation = head->operation;
          VANTAGE_CHECK(end_run(run));
          return unexpected(at, operation, "2 to 7");
        }
      }
      at = end;
    }
    return end_run(run);
  }

  [[nodiscard]] Result<void> walk_chunk(std::uint64_t at) {
    VANTAGE_TRY(const RecordHead head, head_at(at));
    // A chunk that is still being written states no size; its records follow.
    if (head.data_size == 0) return {};
    if (compression_.empty()) VANTAGE_CHECK(name_compression(at));
    Chunk chunk;
    chunk.offset = at;
    chunk.size = head.size();
    chunk.is_cut = head.size() > input().size() - at;
    VANTAGE_CHECK(learn(chunk));
    if (chunk.is_cut) return cut(at);
    return {};
  }

  std::uint64_t index_offset_ = 0, records_offset_ = 0;
  std::uint64_t stated_connections_ = 0, stated_chunks_ = 0;
  std::unordered_map<std::uint32_t, std::uint32_t> connections_;  // their topics
  std::vector<std::uint64_t> counted_;                            // messages of each topic
  std::string compression_;
};

}  // namespace

Result<std::unique_ptr<MessageReader>> read_rosbag1(InputFile file) {
  return opened<Rosbag1Reader>(std::move(file));
}

}  // namespace vantage::io::ros
