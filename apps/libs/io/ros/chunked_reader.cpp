#include "io/ros/chunked_reader.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <limits>

#include "io/ros/bag_readers.hpp"
#include "io/text.hpp"

namespace vantage::io::ros {
namespace {

constexpr std::int64_t kEarliest = std::numeric_limits<std::int64_t>::min();

Error memory_short(const InputFile& file, std::uint64_t offset, std::uint64_t size) {
  return {.code = ErrorCode::io_failure,
          .message = fmt::format("not enough memory for the {} bytes at byte {}", size, offset),
          .where = SourceLocation{file.name(), 0, 0},
          .context = {}};
}

}  // namespace

Result<std::string_view> FileWindow::view(std::uint64_t offset, std::uint64_t size) {
  constexpr std::uint64_t kAhead = 8192;
  if (offset >= file_.size()) return std::string_view{};
  const std::uint64_t left = file_.size() - offset;
  const auto given = static_cast<std::size_t>(std::min(size, left));
  if (offset < offset_ || offset - offset_ > size_ || given > size_ - (offset - offset_)) {
    size_ = 0;
    const auto read = static_cast<std::size_t>(std::min(std::max(size, kAhead), left));
    if (!buffer_.make_room(read, 0)) return fail(memory_short(file_, offset, read));
    VANTAGE_CHECK(file_.read(static_cast<std::size_t>(offset), buffer_.span(read)));
    offset_ = offset;
    size_ = read;
  }
  return buffer_.view(size_).substr(static_cast<std::size_t>(offset - offset_), given);
}

std::optional<std::pair<std::int64_t, std::int64_t>> ChunkedReader::span() const {
  if (chunks_.empty()) return std::nullopt;
  auto span = std::pair{chunks_.front().first, chunks_.front().last};
  for (const Chunk& chunk : chunks_) {
    span = {std::min(span.first, chunk.first), std::max(span.second, chunk.last)};
  }
  return span;
}

Result<void> ChunkedReader::select(const std::vector<std::size_t>& topics) {
  VANTAGE_TRY(selected_, selection(*this, topics));
  from_ = kEarliest;
  rewind();
  return {};
}

Result<void> ChunkedReader::seek(std::int64_t log_time) {
  from_ = log_time;
  rewind();
  return {};
}

void ChunkedReader::rewind() noexcept {
  failure_.reset();
  content_.messages.clear();
  next_chunk_ = next_message_ = 0;
  grown_ = 0;
}

bool ChunkedReader::is_wanted(const Chunk& chunk) const noexcept {
  if (chunk.last < from_) return false;
  if (!chunk.topics) return true;
  return std::any_of(chunk.topics->begin(), chunk.topics->end(),
                     [this](std::uint32_t topic) { return selected_[topic]; });
}

Result<std::optional<BagMessage>> ChunkedReader::next() {
  if (failure_) return fail(*failure_);
  for (;;) {
    while (next_message_ < content_.messages.size()) {
      const Message& message = content_.messages[next_message_++];
      if (!selected_[message.topic] || message.log_time < from_) continue;
      return BagMessage{message.topic, message.log_time,
                        content_.bytes.substr(message.offset, message.size),
                        content_.offset + (content_.is_compressed ? 0 : message.offset)};
    }
    if (next_chunk_ == chunks_.size()) break;
    const Chunk& chunk = chunks_[next_chunk_++];
    if (!is_wanted(chunk)) continue;
    if (auto opened = open(chunk); !opened) {
      content_.messages.clear();
      failure_ = std::move(opened).error();
      return fail(*failure_);
    }
  }
  if (!ending_) return std::nullopt;
  return fail(*ending_);
}

Result<void> ChunkedReader::open(const Chunk& chunk) {
  content_.messages.clear();
  next_message_ = 0;
  VANTAGE_CHECK(load(chunk, content_));
  return check(chunk);
}

Result<void> ChunkedReader::check(const Chunk& chunk) const {
  const auto& messages = content_.messages;
  if (chunk.messages && *chunk.messages != messages.size()) {
    return damaged(fmt::format("the chunk at byte {} has {} messages, its index says {}",
                               chunk.offset, messages.size(), *chunk.messages));
  }
  for (const Message& message : messages) {
    if (message.log_time < chunk.first || message.log_time > chunk.last) {
      return damaged(
          fmt::format("a message of {} ns in the chunk at byte {}, whose index says {} to {} ns",
                      message.log_time, chunk.offset, chunk.first, chunk.last));
    }
    if (chunk.topics &&
        !std::binary_search(chunk.topics->begin(), chunk.topics->end(), message.topic)) {
      return damaged(fmt::format("the chunk at byte {} has messages of {}, its index has none",
                                 chunk.offset, io::quoted(topics_[message.topic].name)));
    }
  }
  return {};
}

Result<void> ChunkedReader::unpack(const Chunk& chunk, const Packed& packed, Content& content) {
  const std::uint64_t there =
      packed.offset < file_.size()
          ? std::min<std::uint64_t>(packed.size, file_.size() - packed.offset)
          : 0;
  if (there < packed.size && !chunk.is_cut) {
    return damaged(fmt::format("the file ends at byte {}, expected {} bytes from byte {} on",
                               file_.size(), packed.size, packed.offset));
  }
  const std::uint64_t most =
      packed.compression == Compression::none ? kLargestChunk : largest_content(packed.size);
  if (std::max(there, packed.unpacked) > most) {
    return damaged(fmt::format("the chunk at byte {} claims {} bytes, expected at most {}",
                               chunk.offset, std::max(there, packed.unpacked), most));
  }
  const auto size = static_cast<std::size_t>(there);
  Buffer& stored = packed.compression == Compression::none ? unpacked_ : packed_;
  if (!stored.make_room(size, 0)) return fail(memory_short(file_, packed.offset, size));
  VANTAGE_CHECK(file_.read(static_cast<std::size_t>(packed.offset), stored.span(size)));
  content.is_compressed = packed.compression != Compression::none;
  content.offset = content.is_compressed ? chunk.offset : packed.offset;
  if (!content.is_compressed) {
    content.bytes = stored.view(size);
    if (packed.size == packed.unpacked || chunk.is_cut) return {};
    return damaged(
        fmt::format("the chunk at byte {} has {} bytes, which are not compressed, it "
                    "says {}",
                    chunk.offset, packed.size, packed.unpacked));
  }
  const Decompressed done =
      decompress(packed.compression, stored.view(size), packed.unpacked, unpacked_);
  content.bytes = unpacked_.view(done.size);
  grown_ += done.size;
  if (grown_ > largest_total(file_.size())) {
    return damaged(
        fmt::format("the chunks to the one at byte {} give {} bytes, expected at most "
                    "{} of a file of {}",
                    chunk.offset, grown_, largest_total(file_.size()), file_.size()));
  }
  if (chunk.is_cut) return {};
  if (!done.problem.empty()) {
    return damaged(
        fmt::format("the chunk at byte {} cannot be decompressed: {}", chunk.offset, done.problem));
  }
  if (done.size != packed.unpacked) {
    return damaged(fmt::format("the chunk at byte {} has {} bytes decompressed, it says {}",
                               chunk.offset, done.size, packed.unpacked));
  }
  return {};
}

Result<Compression> ChunkedReader::compression(std::string_view name, std::uint64_t offset) const {
  if (name.empty() || name == "none") return Compression::none;
  if (name == "bz2") return Compression::bz2;
  if (name == "lz4") return Compression::lz4;
  if (name == "zstd") return Compression::zstd;
  return fail(ErrorCode::unsupported,
              fmt::format("the chunk at byte {} has the compression {}, expected none, bz2, lz4 or "
                          "zstd",
                          offset, io::quoted(name)),
              SourceLocation{file(), 0, 0});
}

std::string ChunkedReader::in_brackets(std::string_view compression) {
  if (compression.empty()) return {};
  const std::string text = io::quoted(compression);
  return fmt::format(" ({})", std::string_view(text).substr(1, text.rfind('\'') - 1));
}

std::string ChunkedReader::place(const Content& content, std::size_t at) {
  if (!content.is_compressed) return fmt::format("byte {}", content.offset + at);
  return fmt::format("byte {} of the decompressed chunk at byte {}", at, content.offset);
}

tl::unexpected<Error> ChunkedReader::damaged(std::string message) const {
  return fail(ErrorCode::corrupt_data, std::move(message), SourceLocation{file(), 0, 0});
}

Result<std::uint32_t> ChunkedReader::topic(const Topic& topic) {
  const auto index = static_cast<std::uint32_t>(topics_.size());
  std::string key = fmt::format("{}\n{}\n{}", topic.name, topic.type, topic.encoding_name);
  if (const auto known = topic_indices_.find(key); known != topic_indices_.end()) {
    return known->second;
  }
  if (is_finished_) {
    return damaged(
        fmt::format("messages of {}, which the bag's index does not have", io::quoted(topic.name)));
  }
  topics_.push_back(topic);
  topic_indices_.emplace(std::move(key), index);
  return index;
}

Result<void> ChunkedReader::load(const Chunk& chunk, Content& content) {
  if (chunk.is_record) {
    VANTAGE_CHECK(load_record(chunk, content));
  } else {
    Packed plain;
    plain.offset = chunk.offset;
    plain.size = plain.unpacked = chunk.size;
    VANTAGE_CHECK(unpack(chunk, plain, content));
  }
  VANTAGE_CHECK(take_apart(chunk, content));
  std::stable_sort(content.messages.begin(), content.messages.end(),
                   [](const Message& a, const Message& b) { return a.log_time < b.log_time; });
  return {};
}

Result<void> ChunkedReader::end_run(Chunk& run) {
  if (run.size == 0) return {};
  Chunk ended = run;
  run.size = 0;
  return learn(std::move(ended));
}

Result<void> ChunkedReader::learn(Chunk chunk) {
  content_.messages.clear();
  VANTAGE_CHECK(load(chunk, content_));
  if (content_.messages.empty()) return {};
  learned_.resize(topics_.size());
  chunk.first = content_.messages.front().log_time;
  chunk.last = content_.messages.back().log_time;
  chunk.messages = content_.messages.size();
  std::vector<std::uint32_t> topics;
  topics.reserve(content_.messages.size());
  for (const Message& message : content_.messages) {
    ++learned_[message.topic];
    topics.push_back(message.topic);
  }
  std::sort(topics.begin(), topics.end());
  topics.erase(std::unique(topics.begin(), topics.end()), topics.end());
  topics.shrink_to_fit();
  chunk.topics = std::move(topics);
  keep(std::move(chunk));
  return {};
}

void ChunkedReader::start_over() {
  topics_.clear();
  topic_indices_.clear();
  learned_.clear();
  chunks_.clear();
  grown_ = 0;
}

void ChunkedReader::finish(std::string format, bool counted) {
  format_ = std::move(format);
  is_finished_ = true;
  learned_.resize(topics_.size());
  for (std::size_t i = 0; counted && i < topics_.size(); ++i) topics_[i].messages = learned_[i];
  std::stable_sort(chunks_.begin(), chunks_.end(),
                   [](const Chunk& a, const Chunk& b) { return a.first < b.first; });
  selected_.assign(topics_.size(), true);
  from_ = kEarliest;
  rewind();
}

}  // namespace vantage::io::ros
