#pragma once

#include <cstdint>
#include <filesystem>
#include <limits>
#include <map>
#include <string>
#include <string_view>
#include <vector>

#include "io/ros/growing_file.hpp"
#include "io/ros/schemas.hpp"
#include "vantage/result.hpp"

namespace vantage::io::ros {

enum class McapCompression : std::uint8_t { none, lz4, zstd };

/// Writes messages of ROS 2 to an MCAP file (MCAP specification, profile "ros2"): compressed and
/// indexed in chunks of about 4 MiB, with a summary and all checksums. The file appears at
/// commit() or keep(); its bytes depend only on what was written. Memory use is that of one chunk,
/// and of the index, about 100 bytes per chunk.
class McapWriter {
 public:
  using ChannelId = std::uint16_t;

  /// Errors: those of GrowingFile::create.
  [[nodiscard]] static Result<McapWriter> create(
      const std::filesystem::path& path, McapCompression compression = McapCompression::zstd);

  /// Adds a record of names and values beside the messages. Errors: those of GrowingFile.
  [[nodiscard]] Result<void> add_metadata(std::string_view name,
                                          const std::map<std::string, std::string>& values);
  /// Errors: `invalid_input` for a topic that exists already, and for more than 65535 topics; those
  /// of GrowingFile.
  [[nodiscard]] Result<ChannelId> add_channel(const std::string& topic,
                                              const MessageSchema& schema);
  /// @param stamp    [s]; the time at which the message was recorded and published
  /// @param message  CDR, with its header
  /// Errors: `invalid_input` for a channel that was not added, or a stamp that is not a valid time
  /// (see time_of); those of GrowingFile.
  /// A chunk that cannot be written is left out, with all messages in it.
  [[nodiscard]] Result<void> write(ChannelId channel, double stamp, std::string_view message);
  /// Puts the file in place; call once, at the end. Errors: those of GrowingFile.
  [[nodiscard]] Result<void> commit();
  /// After an error of another function, puts in place what the file holds, if it holds messages.
  /// A file system that can reserve room has it for the summary; on others, the summary may be
  /// missing.
  /// Errors: those of GrowingFile.
  [[nodiscard]] Result<void> keep();

  /// In the file, or in the chunk that is not written yet.
  [[nodiscard]] std::uint64_t messages() const noexcept { return messages_; }

 private:
  struct Channel {
    std::string topic;
    std::uint32_t messages = 0;
    std::string index;  // of its messages in the current chunk
  };
  /// Earliest and latest log time [ns].
  struct Span {
    std::uint64_t first = std::numeric_limits<std::uint64_t>::max(), last = 0;
    void extend(std::uint64_t time) noexcept;
  };

  McapWriter(GrowingFile file, std::string name, McapCompression compression);
  [[nodiscard]] Result<void> put(std::string_view bytes);
  [[nodiscard]] Result<void> put_chunk();
  void forget_chunk();
  [[nodiscard]] std::string ending() const;
  [[nodiscard]] std::string short_ending() const;
  [[nodiscard]] std::uint64_t room() const noexcept;
  [[nodiscard]] std::string statistics() const;
  [[nodiscard]] tl::unexpected<Error> refuse(std::string message) const;

  GrowingFile file_;
  std::string name_;
  McapCompression compression_;
  std::uint64_t offset_ = 0;  // bytes written so far
  std::uint32_t crc_ = 0;     // of these bytes
  std::vector<MessageSchema> schemas_;
  std::vector<Channel> channels_;  // their id less 1 is the position
  std::string chunk_;              // records, not compressed yet
  Span chunk_span_, span_;
  std::uint64_t messages_ = 0;
  bool ended_ = false;  // with a footer
  std::uint32_t chunks_ = 0, metadata_ = 0;
  // Records for the summary.
  std::string schema_records_, channel_records_, chunk_indexes_, metadata_indexes_;
};

}  // namespace vantage::io::ros
