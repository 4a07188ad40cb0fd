#include "io/ros/mcap_summary.hpp"

#include <fmt/format.h>

#include <algorithm>

#include "io/ros/crc32.hpp"
#include "vantage/kit/byte_io.hpp"

namespace vantage::io::ros::mcap {
namespace {

class SummaryReader {
 public:
  SummaryReader(const InputFile& file, FileWindow& window, const Footer& footer) noexcept
      : file_(file), window_(window), footer_(footer) {}

  [[nodiscard]] Result<Summary> read() {
    constexpr std::uint64_t kLargestRecord = std::uint64_t{1} << 26;
    VANTAGE_CHECK(check());
    for (std::uint64_t at = footer_.summary; at < footer_.offset;) {
      VANTAGE_TRY(const auto head, head_at(window_, at));
      const std::uint64_t left = footer_.offset - at;
      if (!head || left < kRecordHead || head->body > left - kRecordHead) {
        return damaged(
            fmt::format("the record at byte {} goes on after the summary's end at byte {}", at,
                        footer_.offset));
      }
      if (is_read(head->operation)) {
        if (head->body > kLargestRecord) {
          return damaged(fmt::format("the record at byte {} claims {} bytes, expected at most {}",
                                     at, head->body, kLargestRecord));
        }
        VANTAGE_TRY(const std::string_view body, window_.view(at + kRecordHead, head->body));
        VANTAGE_CHECK(add(head->operation, body, at));
      }
      at += kRecordHead + head->body;
    }
    std::sort(summary_.chunks.begin(), summary_.chunks.end(),
              [](const Chunk& a, const Chunk& b) { return a.offset < b.offset; });
    return std::move(summary_);
  }

 private:
  [[nodiscard]] tl::unexpected<Error> damaged(std::string message) const {
    return fail(ErrorCode::corrupt_data, std::move(message), SourceLocation{file_.name(), 0, 0});
  }

  static bool is_read(std::uint8_t operation) noexcept {
    return operation == kSchema || operation == kChannel || operation == kStatistics ||
           operation == kChunkIndex;
  }
  [[nodiscard]] Result<void> add(std::uint8_t operation, std::string_view body, std::uint64_t at) {
    if (operation == kStatistics) return add_statistics(body, at);
    if (operation == kChunkIndex) return add_chunk(body, at);
    (operation == kSchema ? summary_.schemas : summary_.channels).emplace_back(body, at);
    return {};
  }

  [[nodiscard]] Result<void> add_statistics(std::string_view body, std::uint64_t at) {
    ByteReader reader(body);
    static_cast<void>(reader.raw(8 + 2 + 4 + 4 + 4));  // counts of other records
    summary_.chunk_count = reader.number<std::uint32_t>();
    static_cast<void>(reader.raw(16));  // times
    ByteReader counts(reader.text<std::uint32_t>());
    while (counts.left() != 0) {
      const auto channel = counts.number<std::uint16_t>();
      summary_.messages[channel] = counts.number<std::uint64_t>();
    }
    if (reader.ok() && counts.ok()) return {};
    return damaged(fmt::format("the statistics at byte {} end too early", at));
  }

  [[nodiscard]] Result<void> add_chunk(std::string_view body, std::uint64_t at) {
    ByteReader reader(body);
    const auto first = reader.number<std::uint64_t>();
    const auto last = reader.number<std::uint64_t>();
    Chunk chunk;
    chunk.offset = reader.number<std::uint64_t>();
    chunk.size = reader.number<std::uint64_t>();
    ByteReader indices(reader.text<std::uint32_t>());
    std::vector<std::uint32_t> channels;
    while (indices.left() != 0) {
      channels.push_back(indices.number<std::uint16_t>());
      static_cast<void>(indices.number<std::uint64_t>());  // where its message index is
    }
    const auto index_size = reader.number<std::uint64_t>();
    const std::string_view compression = reader.text<std::uint32_t>();
    if (!reader.ok() || !indices.ok()) {
      return damaged(fmt::format("the chunk index at byte {} ends too early", at));
    }
    const std::uint64_t most = file_.size();
    if (first > last || last > kLatest || chunk.size == 0 || chunk.size > most ||
        index_size > most) {
      return damaged(
          fmt::format("the chunk index at byte {} claims a chunk of {} bytes from {} to {} ns", at,
                      chunk.size, first, last));
    }
    chunk.size += index_size;
    chunk.first = static_cast<std::int64_t>(first);
    chunk.last = static_cast<std::int64_t>(last);
    if (!channels.empty()) chunk.topics = std::move(channels);  // else no index was written
    if (summary_.chunks.empty()) summary_.compression = compression.empty() ? "none" : compression;
    summary_.chunks.push_back(std::move(chunk));
    return {};
  }

  /// The checksum covers everything from the beginning of the summary up to the checksum itself.
  [[nodiscard]] Result<void> check() const {
    constexpr std::uint64_t kAtOnce = 1 << 16;
    if (footer_.checksum == 0) return {};
    const std::uint64_t end = footer_.offset + kFooterSize - sizeof(footer_.checksum);
    std::uint32_t sum = 0;
    for (std::uint64_t at = footer_.summary; at < end; at += kAtOnce) {
      VANTAGE_TRY(const std::string_view bytes, window_.view(at, std::min(kAtOnce, end - at)));
      sum = crc32(bytes, sum);
    }
    if (sum == footer_.checksum) return {};
    return damaged(fmt::format("the summary at byte {} has the checksum {:08x}, expected {:08x}",
                               footer_.summary, sum, footer_.checksum));
  }

  const InputFile& file_;
  FileWindow& window_;
  const Footer& footer_;
  Summary summary_;
};

}  // namespace

Result<std::optional<RecordHead>> head_at(FileWindow& window, std::uint64_t offset) {
  VANTAGE_TRY(const std::string_view bytes, window.view(offset, kRecordHead));
  ByteReader reader(bytes);
  RecordHead head;
  head.operation = reader.number<std::uint8_t>();
  head.body = reader.number<std::uint64_t>();
  if (!reader.ok()) return std::nullopt;
  return head;
}

Result<Footer> read_footer(const InputFile& file, FileWindow& window) {
  Footer footer;
  if (file.size() < 2 * kMagic.size() + kFooterSize) return footer;
  footer.offset = file.size() - kMagic.size() - kFooterSize;
  VANTAGE_TRY(const std::string_view bytes,
              window.view(footer.offset, kFooterSize + kMagic.size()));
  ByteReader reader(bytes);
  const auto operation = reader.number<std::uint8_t>();
  const auto body = reader.number<std::uint64_t>();
  if (operation != kFooter || body != kFooterSize - kRecordHead || !bytes.ends_with(kMagic)) {
    return footer;
  }
  footer.is_there = true;
  footer.summary = reader.number<std::uint64_t>();
  static_cast<void>(reader.number<std::uint64_t>());  // summary_offset_start
  footer.checksum = reader.number<std::uint32_t>();
  return footer;
}

Result<Summary> read_summary(const InputFile& file, FileWindow& window, const Footer& footer) {
  if (footer.summary < kMagic.size() || footer.summary > footer.offset) {
    return fail(ErrorCode::corrupt_data,
                fmt::format("the footer at byte {} names a summary at byte {}, expected {} to {}",
                            footer.offset, footer.summary, kMagic.size(), footer.offset),
                SourceLocation{file.name(), 0, 0});
  }
  return SummaryReader(file, window, footer).read();
}

}  // namespace vantage::io::ros::mcap
