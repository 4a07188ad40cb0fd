#include <fmt/format.h>

#include <algorithm>
#include <limits>
#include <unordered_map>

#include "io/ros/bag_readers.hpp"
#include "io/ros/chunked_reader.hpp"
#include "io/ros/crc32.hpp"
#include "io/ros/mcap_summary.hpp"
#include "io/text.hpp"
#include "vantage/kit/byte_io.hpp"

namespace vantage::io::ros {
namespace {

using namespace mcap;

std::optional<Encoding> encoding_of(std::string_view name) noexcept {
  if (name == "cdr") return Encoding::cdr;
  if (name == "ros1") return Encoding::ros1;
  return std::nullopt;
}

class McapReader final : public ChunkedReader {
 public:
  explicit McapReader(InputFile file) noexcept : ChunkedReader(std::move(file)) {}

  [[nodiscard]] Result<void> open() {
    VANTAGE_TRY(const std::string_view magic, window().view(0, kMagic.size()));
    if (magic != kMagic) {
      const bool is_other = magic.size() == kMagic.size() && looks_like_mcap(magic);
      return fail(is_other ? ErrorCode::unsupported : ErrorCode::corrupt_data,
                  fmt::format("begins with {}, expected the magic of MCAP 0", io::quoted(magic)),
                  SourceLocation{file(), 0, 0});
    }
    auto indexed = read_with_index();
    if (!indexed && indexed.error().code == ErrorCode::io_failure) return fail(indexed.error());
    const bool is_indexed = indexed && *indexed;
    if (!is_indexed) {
      VANTAGE_CHECK(read_without_index());
      if (!indexed && !ending_is_set_) end_with(std::move(indexed).error());
    }
    finish(fmt::format("MCAP{}{}", in_brackets(compression_), is_indexed ? "" : ", not indexed"),
           !is_indexed);
    return {};
  }

 private:
  // ----- chunks and their content

  [[nodiscard]] Result<void> load_record(const Chunk& chunk, Content& content) override {
    constexpr std::uint64_t kLongestHead = 256;  // the name of a compression is a word
    VANTAGE_TRY(const std::string_view bytes, window().view(chunk.offset, kLongestHead));
    ByteReader reader(bytes);
    const auto operation = reader.number<std::uint8_t>();
    const auto body = reader.number<std::uint64_t>();
    static_cast<void>(reader.raw(16));  // the times, which the messages also contain
    Packed packed;
    packed.unpacked = reader.number<std::uint64_t>();
    const auto checksum = reader.number<std::uint32_t>();
    const std::string_view name = reader.text<std::uint32_t>();
    packed.size = reader.number<std::uint64_t>();
    packed.offset = chunk.offset + reader.offset();
    if (!reader.ok() && chunk.is_cut) {
      content.bytes = {};
      return {};
    }
    if (!reader.ok() || operation != kChunk) {
      return damaged(fmt::format("expected a chunk (opcode 6) at byte {}", chunk.offset));
    }
    const std::uint64_t head = reader.offset() - kRecordHead;
    if (body < head) {
      return damaged(
          fmt::format("the chunk at byte {} has {} bytes, expected at least the {} before its "
                      "records",
                      chunk.offset, body, head));
    }
    if (packed.size > body - head) {
      return damaged(
          fmt::format("the chunk at byte {} claims {} bytes of records, expected at most "
                      "{}",
                      chunk.offset, packed.size, body - head));
    }
    VANTAGE_TRY(packed.compression, compression(name, chunk.offset));
    if (compression_.empty()) compression_ = name.empty() ? "none" : std::string(name);
    VANTAGE_CHECK(unpack(chunk, packed, content));
    if (checksum == 0 || chunk.is_cut) return {};
    if (const std::uint32_t sum = crc32(content.bytes); sum != checksum) {
      return damaged(fmt::format("the chunk at byte {} has the checksum {:08x}, expected {:08x}",
                                 chunk.offset, sum, checksum));
    }
    return {};
  }

  /// Finds schemas, channels and messages.
  [[nodiscard]] Result<void> take_apart(const Chunk& chunk, Content& content) override {
    ByteReader reader(content.bytes);
    while (reader.left() != 0) {
      const std::size_t at = reader.offset();
      const auto here = [&content, at] { return place(content, at); };
      const auto operation = reader.number<std::uint8_t>();
      const std::string_view body = reader.raw(reader.number<std::uint64_t>());
      if (!reader.ok()) {
        if (chunk.is_cut) return {};
        return damaged(fmt::format("the record at {} goes on after the chunk's end", here()));
      }
      if (operation == kMessage) {
        VANTAGE_TRY(Message message, message_of(body, here));
        message.offset = at + kRecordHead + kMessageHead;
        message.size = body.size() - kMessageHead;
        content.messages.push_back(message);
      } else if (operation == kSchema) {
        VANTAGE_CHECK(add_schema(body, here()));
      } else if (operation == kChannel) {
        VANTAGE_CHECK(add_channel(body, here()));
      }
    }
    return {};
  }

  /// @param place  std::string(); made only when it is needed
  template <class Place>
  [[nodiscard]] Result<Message> message_of(std::string_view body, const Place& place) const {
    ByteReader reader(body);
    const auto channel = reader.number<std::uint16_t>();
    static_cast<void>(reader.number<std::uint32_t>());  // sequence
    const auto log_time = reader.number<std::uint64_t>();
    static_cast<void>(reader.number<std::uint64_t>());  // publish_time
    if (!reader.ok()) {
      return damaged(fmt::format("the message at {} has {} bytes, expected at least {}", place(),
                                 body.size(), kMessageHead));
    }
    const auto known = channels_.find(channel);
    if (known == channels_.end()) {
      return damaged(
          fmt::format("the message at {} is of channel {}, which is not there", place(), channel));
    }
    if (log_time > kLatest) {
      return damaged(fmt::format("the message at {} was logged at {} ns, expected at most {}",
                                 place(), log_time, kLatest));
    }
    Message message;
    message.topic = known->second;
    message.log_time = static_cast<std::int64_t>(log_time);
    return message;
  }

  [[nodiscard]] Result<void> add_schema(std::string_view body, const std::string& place) {
    ByteReader reader(body);
    const auto number = reader.number<std::uint16_t>();
    const std::string_view name = reader.text<std::uint32_t>();
    if (!reader.ok() || number == 0) {
      return damaged(fmt::format("the schema at {} has no number or no name", place));
    }
    const auto [known, is_new] = schemas_.emplace(number, name);
    if (is_new || known->second == name) return {};
    return damaged(
        fmt::format("the schema at {} is number {}, which is that of another: {} is not "
                    "{}",
                    place, number, io::quoted(name), io::quoted(known->second)));
  }

  [[nodiscard]] Result<void> add_channel(std::string_view body, const std::string& place) {
    ByteReader reader(body);
    const auto number = reader.number<std::uint16_t>();
    const auto schema = reader.number<std::uint16_t>();
    Topic described;
    described.name = reader.text<std::uint32_t>();
    described.encoding_name = reader.text<std::uint32_t>();
    described.encoding = encoding_of(described.encoding_name);
    if (!reader.ok()) {
      return damaged(
          fmt::format("the channel at {} has no number, schema, topic or encoding", place));
    }
    if (schema != 0) {
      const auto type = schemas_.find(schema);
      if (type == schemas_.end()) {
        return damaged(
            fmt::format("the channel at {} has the schema {}, which is not there", place, schema));
      }
      described.type = described.encoding ? ros1_spelling(type->second) : type->second;
    }
    VANTAGE_TRY(const std::uint32_t index, topic(described));
    const auto [known, is_new] = channels_.emplace(number, index);
    if (is_new || known->second == index) return {};
    return damaged(fmt::format(
        "the channel at {} is number {}, which is that of another topic: {} "
        "is not {}",
        place, number, io::quoted(described.name), io::quoted(topics()[known->second].name)));
  }

  // ----- records outside of chunks

  [[nodiscard]] tl::unexpected<Error> cut(std::uint64_t offset, std::uint64_t end) const {
    return damaged(fmt::format("{} at byte {}, inside the record at byte {}",
                               end == input().size() ? "the file ends" : "the records end", end,
                               offset));
  }

  /// Goes through the records up to `end`; `known` chunks are not read.
  /// @param known  in the order of their offsets
  [[nodiscard]] Result<void> walk(std::uint64_t end, const std::vector<Chunk>& known) {
    Chunk run;  // of schemas, channels and messages outside of chunks
    run.is_record = false;
    auto next_known = known.begin();
    for (std::uint64_t at = kMagic.size(); at < end;) {
      if (next_known != known.end() && next_known->offset == at) {
        VANTAGE_CHECK(end_run(run));
        at += next_known->size;
        keep(*next_known++);
        continue;
      }
      VANTAGE_TRY(const auto head, head_at(window(), at));
      const bool is_whole = head && head->body <= end - at - std::min(kRecordHead, end - at);
      if (!is_whole) {
        VANTAGE_CHECK(end_run(run));
        if (head && head->operation == kChunk) VANTAGE_CHECK(learn(cut_chunk(at, end)));
        return cut(at, end);
      }
      const std::uint64_t size = kRecordHead + head->body;
      if (head->operation == kDataEnd || head->operation == kFooter) break;
      if (head->operation == kSchema || head->operation == kChannel ||
          head->operation == kMessage) {
        if (run.size == 0) run.offset = at;
        run.size = at + size - run.offset;
        if (run.size >= kLargestRun) VANTAGE_CHECK(end_run(run));
      } else {
        VANTAGE_CHECK(end_run(run));
        if (head->operation == kChunk) {
          Chunk chunk;
          chunk.offset = at;
          chunk.size = size;
          VANTAGE_CHECK(learn(std::move(chunk)));
        }
      }
      at += size;
    }
    VANTAGE_CHECK(end_run(run));
    if (next_known == known.end()) return {};
    return damaged(
        fmt::format("the index names a chunk at byte {}, where none is", next_known->offset));
  }
  static Chunk cut_chunk(std::uint64_t at, std::uint64_t end) {
    Chunk chunk;
    chunk.offset = at;
    chunk.size = end - at;
    chunk.is_cut = true;
    return chunk;
  }

  [[nodiscard]] Result<void> read_without_index() {
    start_over();
    schemas_.clear();
    channels_.clear();
    compression_.clear();
    auto walked = walk(input().size() - (is_closed_ ? kFooterSize + kMagic.size() : 0), {});
    if (walked && !is_closed_) {
      walked = damaged(
          fmt::format("the file ends at byte {}, expected a footer before it", input().size()));
    }
    if (walked) return {};
    if (walked.error().code == ErrorCode::io_failure) return walked;
    ending_is_set_ = true;
    end_with(std::move(walked).error());
    return {};
  }

  // ----- the summary

  /// False for a file without an index.
  [[nodiscard]] Result<bool> read_with_index() {
    VANTAGE_TRY(const Footer footer, read_footer(input(), window()));
    is_closed_ = footer.is_there;
    if (footer.summary == 0) return false;
    VANTAGE_TRY(Summary summary, read_summary(input(), window(), footer));
    if (summary.channels.empty() || summary.chunks.empty()) return false;
    if (summary.chunk_count && *summary.chunk_count != summary.chunks.size()) return false;
    for (const auto& [schema, at] : summary.schemas) {
      VANTAGE_CHECK(add_schema(schema, fmt::format("byte {}", at)));
    }
    for (const auto& [channel, at] : summary.channels) {
      VANTAGE_CHECK(add_channel(channel, fmt::format("byte {}", at)));
    }
    VANTAGE_CHECK(name_topics(summary));
    compression_ = summary.compression;
    VANTAGE_CHECK(walk(footer.summary, summary.chunks));
    if (!summary.messages.empty()) count_messages(summary);
    return true;
  }

  /// Turns channels into topics.
  [[nodiscard]] Result<void> name_topics(Summary& summary) const {
    for (Chunk& chunk : summary.chunks) {
      if (!chunk.topics) continue;
      for (std::uint32_t& topic : *chunk.topics) {
        const auto known = channels_.find(static_cast<std::uint16_t>(topic));
        if (known == channels_.end()) {
          return damaged(
              fmt::format("the chunk at byte {} has messages of channel {}, which the "
                          "summary does not have",
                          chunk.offset, topic));
        }
        topic = known->second;
      }
      std::sort(chunk.topics->begin(), chunk.topics->end());
    }
    return {};
  }

  void count_messages(const Summary& summary) {
    std::vector<std::uint64_t> counts(topics().size(), 0);
    for (const auto& [channel, messages] : summary.messages) {
      const auto known = channels_.find(channel);
      if (known != channels_.end()) counts[known->second] += messages;
    }
    for (std::uint32_t i = 0; i < counts.size(); ++i) count(i, counts[i]);
  }

  std::unordered_map<std::uint16_t, std::string> schemas_;
  std::unordered_map<std::uint16_t, std::uint32_t> channels_;  // their topics
  std::string compression_;
  bool is_closed_ = false;  // with a footer
  bool ending_is_set_ = false;
};

}  // namespace

Result<std::unique_ptr<MessageReader>> read_mcap(InputFile file) {
  return opened<McapReader>(std::move(file));
}

}  // namespace vantage::io::ros
