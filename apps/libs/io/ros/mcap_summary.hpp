#pragma once

#include <cstdint>
#include <limits>
#include <map>
#include <optional>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "io/ros/chunked_reader.hpp"
#include "vantage/kit/file_content.hpp"
#include "vantage/result.hpp"

/// Records of MCAP and the end of a file: https://mcap.dev/spec
namespace vantage::io::ros::mcap {

enum Operation : std::uint8_t {
  kFooter = 0x02,
  kSchema = 0x03,
  kChannel = 0x04,
  kMessage = 0x05,
  kChunk = 0x06,
  kChunkIndex = 0x08,
  kStatistics = 0x0B,
  kDataEnd = 0x0F,
};

inline constexpr std::string_view kMagic("\x89MCAP0\r\n", 8);
inline constexpr std::uint64_t kRecordHead = 9;  // opcode and size [bytes]
inline constexpr std::uint64_t kFooterSize = kRecordHead + 20;
inline constexpr std::uint64_t kMessageHead = 22;  // before the bytes of a message [bytes]
inline constexpr auto kLatest =
    static_cast<std::uint64_t>(std::numeric_limits<std::int64_t>::max());  // log time [ns]

struct RecordHead {
  std::uint8_t operation = 0;
  std::uint64_t body = 0;  // [bytes]
};

/// Nothing if the file ends within the record's head. Errors: `io_failure`.
[[nodiscard]] Result<std::optional<RecordHead>> head_at(FileWindow& window, std::uint64_t offset);

struct Footer {
  bool is_there = false;       // with the magic bytes after it
  std::uint64_t offset = 0;    // its own [bytes]
  std::uint64_t summary = 0;   // offset; 0 for none
  std::uint32_t checksum = 0;  // of the summary; 0 for none
};
/// Errors: `io_failure`.
[[nodiscard]] Result<Footer> read_footer(const InputFile& file, FileWindow& window);

/// What the summary says. The topics of its chunks are still the numbers of channels; their sizes
/// include the message indexes after them.
struct Summary {
  std::vector<std::pair<std::string, std::uint64_t>> schemas, channels;  // bodies and offsets
  std::vector<Chunk> chunks;  // in the order of their offsets
  std::optional<std::uint32_t> chunk_count;
  std::map<std::uint16_t, std::uint64_t> messages;  // of channels
  std::string compression;                          // of the first chunk
};
/// Errors: `corrupt_data`, `io_failure`. Precondition: footer.summary is not 0.
[[nodiscard]] Result<Summary> read_summary(const InputFile& file, FileWindow& window,
                                           const Footer& footer);

}  // namespace vantage::io::ros::mcap
