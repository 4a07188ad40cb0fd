#include "io/ros/mcap_writer.hpp"

#include <fmt/format.h>
#include <lz4frame.h>
#include <zstd.h>

#include <algorithm>
#include <utility>

#include "io/ros/crc32.hpp"
#include "io/ros/little_endian.hpp"
#include "io/ros/mcap_summary.hpp"
#include "io/ros/ros_time.hpp"

namespace vantage::io::ros {
namespace {

constexpr std::size_t kChunkSize = std::size_t{4} << 20;
constexpr int kZstdLevel = 3;

enum class Opcode : std::uint8_t {
  header = 1,
  footer = 2,
  schema = 3,
  channel = 4,
  message = 5,
  chunk = 6,
  message_index = 7,
  chunk_index = 8,
  statistics = 11,
  metadata = 12,
  metadata_index = 13,
  summary_offset = 14,
  data_end = 15
};

/// The members of a record, one after the other (MCAP specification, "Serialization").
class Content {
 public:
  template <class T>
  Content& number(T value) {
    append_little_endian(bytes_, value);
    return *this;
  }
  Content& bytes(std::string_view bytes) {
    bytes_ += bytes;
    return *this;
  }
  /// A string, an array or a map.
  Content& sized(std::string_view bytes) {
    return number(static_cast<std::uint32_t>(bytes.size())).bytes(bytes);
  }
  [[nodiscard]] const std::string& view() const noexcept { return bytes_; }

 private:
  std::string bytes_;
};

/// The bytes before a record's content.
std::string head(Opcode opcode, std::uint64_t size) {
  std::string bytes(1, static_cast<char>(opcode));
  append_little_endian(bytes, size);
  return bytes;
}

std::string record(Opcode opcode, const Content& content) {
  return head(opcode, content.view().size()) + content.view();
}

std::string_view name_of(McapCompression compression) {
  switch (compression) {
    case McapCompression::none: return "";
    case McapCompression::lz4: return "lz4";
    case McapCompression::zstd: return "zstd";
  }
  return "";
}

Result<std::string> compressed(std::string_view bytes, McapCompression compression) {
  if (compression == McapCompression::none) return std::string(bytes);
  const bool zstd = compression == McapCompression::zstd;
  std::string out(
      zstd ? ZSTD_compressBound(bytes.size()) : LZ4F_compressFrameBound(bytes.size(), nullptr),
      '\0');
  const std::size_t size =
      zstd ? ZSTD_compress(out.data(), out.size(), bytes.data(), bytes.size(), kZstdLevel)
           : LZ4F_compressFrame(out.data(), out.size(), bytes.data(), bytes.size(), nullptr);
  if (zstd ? ZSTD_isError(size) != 0 : LZ4F_isError(size) != 0) {
    return fail(ErrorCode::internal,
                fmt::format("a chunk of {} bytes cannot be compressed ({})", bytes.size(),
                            zstd ? ZSTD_getErrorName(size) : LZ4F_getErrorName(size)));
  }
  out.resize(size);
  return out;
}

}  // namespace

void McapWriter::Span::extend(std::uint64_t time) noexcept {
  first = std::min(first, time);
  last = std::max(last, time);
}

McapWriter::McapWriter(GrowingFile file, std::string name, McapCompression compression)
    : file_(std::move(file)), name_(std::move(name)), compression_(compression) {}

Result<McapWriter> McapWriter::create(const std::filesystem::path& path,
                                      McapCompression compression) {
  VANTAGE_TRY(auto file, GrowingFile::create(path));
  McapWriter writer(std::move(file), path.string(), compression);
  VANTAGE_CHECK(writer.put(std::string(mcap::kMagic) +
                           record(Opcode::header, Content().sized("ros2").sized("vantage"))));
  return writer;
}

tl::unexpected<Error> McapWriter::refuse(std::string message) const {
  return fail(ErrorCode::invalid_input, std::move(message), SourceLocation{name_, 0, 0});
}

Result<void> McapWriter::put(std::string_view bytes) {
  VANTAGE_CHECK(file_.append(bytes, room()));
  crc_ = crc32(bytes, crc_);
  offset_ += bytes.size();
  return {};
}

/// What the summary needs after the next bytes at most: they add a record or two to it.
std::uint64_t McapWriter::room() const noexcept {
  constexpr std::uint64_t kNext = 64U << 10U, kOfChannel = 32;
  return schema_records_.size() + channel_records_.size() + chunk_indexes_.size() +
         metadata_indexes_.size() + kOfChannel * channels_.size() + kNext;
}

Result<void> McapWriter::add_metadata(std::string_view name,
                                      const std::map<std::string, std::string>& values) {
  Content entries;
  for (const auto& [key, value] : values) entries.sized(key).sized(value);
  const std::string metadata =
      record(Opcode::metadata, Content().sized(name).sized(entries.view()));
  const std::uint64_t start = offset_;
  VANTAGE_CHECK(put(metadata));
  metadata_indexes_ +=
      record(Opcode::metadata_index,
             Content().number(start).number(std::uint64_t{metadata.size()}).sized(name));
  ++metadata_;
  return {};
}

Result<McapWriter::ChannelId> McapWriter::add_channel(const std::string& topic,
                                                      const MessageSchema& schema) {
  if (std::any_of(channels_.begin(), channels_.end(),
                  [&](const Channel& channel) { return channel.topic == topic; })) {
    return refuse(fmt::format("the topic {} exists already", topic));
  }
  if (channels_.size() == std::numeric_limits<ChannelId>::max()) {
    return refuse(fmt::format("{} is one topic too many for an MCAP file", topic));
  }
  const auto known = std::find(schemas_.begin(), schemas_.end(), schema);
  const auto schema_id = static_cast<std::uint16_t>(known - schemas_.begin() + 1);
  if (known == schemas_.end()) {
    const std::string described =
        record(Opcode::schema,
               Content().number(schema_id).sized(schema.name).sized("ros2msg").sized(schema.text));
    VANTAGE_CHECK(put(described));
    schemas_.push_back(schema);
    schema_records_ += described;
  }
  const auto id = static_cast<ChannelId>(channels_.size() + 1);
  // The profile "ros2" requires the entry; an empty one says nothing about the quality of service.
  const std::string quality = Content().sized("offered_qos_profiles").sized("").view();
  const std::string described =
      record(Opcode::channel,
             Content().number(id).number(schema_id).sized(topic).sized("cdr").sized(quality));
  VANTAGE_CHECK(put(described));
  channels_.push_back({.topic = topic, .messages = 0, .index = {}});
  channel_records_ += described;
  return id;
}

Result<void> McapWriter::write(ChannelId channel, double stamp, std::string_view message) {
  if (channel == 0 || channel > channels_.size()) {
    return refuse(fmt::format("a message for channel {}, which was not added", channel));
  }
  const auto stamped = time_of(stamp);
  if (!stamped) return refuse(stamped.error().message);
  const std::uint64_t time = stamped->nanoseconds();
  Channel& to = channels_[channel - 1U];
  append_little_endian(to.index, time);
  append_little_endian(to.index, std::uint64_t{chunk_.size()});
  const Content members = Content().number(channel).number(to.messages).number(time).number(time);
  chunk_ += head(Opcode::message, members.view().size() + message.size());
  chunk_ += members.view();
  chunk_ += message;
  ++to.messages;
  ++messages_;
  chunk_span_.extend(time);
  if (chunk_.size() < kChunkSize) return {};
  return put_chunk();
}

void McapWriter::forget_chunk() {
  constexpr std::size_t kEntry = 2 * sizeof(std::uint64_t);
  for (Channel& channel : channels_) {
    const std::size_t messages = channel.index.size() / kEntry;
    channel.messages -= static_cast<std::uint32_t>(messages);
    messages_ -= messages;
    channel.index.clear();
  }
  chunk_.clear();
  chunk_span_ = {};
}

Result<void> McapWriter::put_chunk() {
  VANTAGE_TRY(const std::string records, compressed(chunk_, compression_));
  const std::uint64_t size = records.size(), whole_size = chunk_.size();
  const Content members = Content()
                              .number(chunk_span_.first)
                              .number(chunk_span_.last)
                              .number(whole_size)
                              .number(crc32(chunk_))
                              .sized(name_of(compression_))
                              .number(size);
  std::string bytes = head(Opcode::chunk, members.view().size() + size) + members.view() + records;
  const std::uint64_t chunk_size = bytes.size();
  Content indexes;
  for (std::size_t i = 0; i < channels_.size(); ++i) {
    if (channels_[i].index.empty()) continue;
    const auto id = static_cast<ChannelId>(i + 1);
    indexes.number(id).number(offset_ + bytes.size());
    bytes += record(Opcode::message_index, Content().number(id).sized(channels_[i].index));
  }
  const std::string index = record(Opcode::chunk_index, Content()
                                                            .number(chunk_span_.first)
                                                            .number(chunk_span_.last)
                                                            .number(offset_)
                                                            .number(chunk_size)
                                                            .sized(indexes.view())
                                                            .number(bytes.size() - chunk_size)
                                                            .sized(name_of(compression_))
                                                            .number(size)
                                                            .number(whole_size));
  if (auto done = put(bytes); !done) {
    forget_chunk();
    return done;
  }
  chunk_indexes_ += index;
  ++chunks_;
  span_.extend(chunk_span_.first);
  span_.extend(chunk_span_.last);
  for (Channel& channel : channels_) channel.index.clear();
  chunk_.clear();
  chunk_span_ = {};
  return {};
}

std::string McapWriter::statistics() const {
  Content counts;
  for (std::size_t i = 0; i < channels_.size(); ++i) {
    counts.number(static_cast<ChannelId>(i + 1)).number(std::uint64_t{channels_[i].messages});
  }
  return record(Opcode::statistics, Content()
                                        .number(messages_)
                                        .number(static_cast<std::uint16_t>(schemas_.size()))
                                        .number(static_cast<std::uint32_t>(channels_.size()))
                                        .number(std::uint32_t{0})  // attachments
                                        .number(metadata_)
                                        .number(chunks_)
                                        .number(messages_ > 0 ? span_.first : 0)
                                        .number(span_.last)
                                        .sized(counts.view()));
}

/// What follows the last chunk: the end of the data, the summary and the magic.
std::string McapWriter::ending() const {
  const std::string end = record(Opcode::data_end, Content().number(crc_));
  const std::uint64_t start = offset_ + end.size();
  const std::string statistics = this->statistics();
  const std::pair<Opcode, const std::string&> groups[] = {
      {Opcode::schema, schema_records_},
      {Opcode::channel, channel_records_},
      {Opcode::statistics, statistics},
      {Opcode::chunk_index, chunk_indexes_},
      {Opcode::metadata_index, metadata_indexes_}};
  std::string summary, offsets;
  for (const auto& [opcode, records] : groups) {
    if (records.empty()) continue;
    offsets += record(Opcode::summary_offset, Content()
                                                  .number(static_cast<std::uint8_t>(opcode))
                                                  .number(start + summary.size())
                                                  .number(std::uint64_t{records.size()}));
    summary += records;
  }
  const Content members = Content().number(start).number(start + summary.size());
  summary += offsets;
  summary += head(Opcode::footer, members.view().size() + sizeof(std::uint32_t));
  summary += members.view();
  summary += Content().number(crc32(summary)).view();
  return end + summary + std::string(mcap::kMagic);
}

/// The same without a summary.
std::string McapWriter::short_ending() const {
  const Content none =
      Content().number(std::uint64_t{0}).number(std::uint64_t{0}).number(std::uint32_t{0});
  return record(Opcode::data_end, Content().number(crc_)) + record(Opcode::footer, none) +
         std::string(mcap::kMagic);
}

Result<void> McapWriter::commit() {
  if (!chunk_.empty()) VANTAGE_CHECK(put_chunk());
  VANTAGE_CHECK(file_.append(ending(), 0));
  ended_ = true;
  return file_.commit();
}

Result<void> McapWriter::keep() {
  if (!chunk_.empty()) (void)put_chunk();
  if (chunks_ == 0) return {};
  // Readers that find no summary look at every chunk. The short ending fits into the last block of
  // most files, whatever the disk says.
  if (!ended_) ended_ = file_.append(ending(), 0) || file_.append(short_ending(), 0);
  return file_.commit();
}

}  // namespace vantage::io::ros
