#pragma once

#include <cstddef>
#include <cstdint>
#include <optional>
#include <string>
#include <string_view>
#include <unordered_map>
#include <utility>
#include <vector>

#include "io/ros/decompress.hpp"
#include "io/ros/message_reader.hpp"
#include "vantage/kit/file_content.hpp"
#include "vantage/result.hpp"

namespace vantage::io::ros {

/// Short pieces of a file, one after the other, without a system call for each.
class FileWindow {
 public:
  explicit FileWindow(const InputFile& file) noexcept : file_(file) {}
  /// As many of `size` bytes as the file contains there; valid until the next call.
  /// Errors: `io_failure`.
  [[nodiscard]] Result<std::string_view> view(std::uint64_t offset, std::uint64_t size);

 private:
  const InputFile& file_;
  Buffer buffer_;
  std::uint64_t offset_ = 0;
  std::size_t size_ = 0;
};

/// Messages that are read together: a chunk, or consecutive messages outside of chunks.
struct Chunk {
  std::uint64_t offset = 0;                          ///< of its record in the file [bytes]
  std::uint64_t size = 0;                            ///< including the record around it [bytes]
  bool is_record = true;                             ///< false for messages outside of chunks
  bool is_cut = false;                               ///< the file ends within it
  std::int64_t first = 0, last = 0;                  ///< log times [ns]
  std::optional<std::uint64_t> messages;             ///< their number, if it is known
  std::optional<std::vector<std::uint32_t>> topics;  ///< in ascending order, if they are known
};

/// The common part of the readers of bags with chunks; they find the chunks and parse them.
class ChunkedReader : public MessageReader {
 public:
  [[nodiscard]] const std::string& format() const final { return format_; }
  [[nodiscard]] const std::string& file() const final { return file_.name(); }
  [[nodiscard]] const std::vector<Topic>& topics() const final { return topics_; }
  [[nodiscard]] std::optional<std::pair<std::int64_t, std::int64_t>> span() const final;
  [[nodiscard]] Result<void> select(const std::vector<std::size_t>& topics) final;
  [[nodiscard]] Result<std::optional<BagMessage>> next() final;
  [[nodiscard]] Result<void> seek(std::int64_t log_time) final;

 protected:
  struct Message {
    std::int64_t log_time = 0;
    std::uint32_t topic = 0;
    std::uint64_t offset = 0, size = 0;  // in the content
  };
  /// The content of a chunk and its messages.
  struct Content {
    std::string_view bytes;
    std::uint64_t offset = 0;  // in the file, of its first byte or of the chunk
    bool is_compressed = false;
    std::vector<Message> messages;
  };
  /// How a chunk is stored.
  struct Packed {
    std::uint64_t offset = 0, size = 0;  // in the file [bytes]
    Compression compression = Compression::none;
    std::uint64_t unpacked = 0;  // stated [bytes]
  };

  explicit ChunkedReader(InputFile file) noexcept : file_(std::move(file)), window_(file_) {}

  /// Makes the content of a chunk that is a record.
  [[nodiscard]] virtual Result<void> load_record(const Chunk& chunk, Content& content) = 0;
  /// Finds the messages in the content and registers what topics it brings.
  [[nodiscard]] virtual Result<void> take_apart(const Chunk& chunk, Content& content) = 0;

  /// Reads and decompresses a chunk; for a chunk that is cut off, as much as there is.
  [[nodiscard]] Result<void> unpack(const Chunk& chunk, const Packed& packed, Content& content);
  [[nodiscard]] Result<Compression> compression(std::string_view name, std::uint64_t offset) const;
  /// " (lz4)"; nothing for a bag without chunks.
  [[nodiscard]] static std::string in_brackets(std::string_view compression);
  /// "byte 17", "byte 17 of the decompressed chunk at byte 4117".
  [[nodiscard]] static std::string place(const Content& content, std::size_t at);
  [[nodiscard]] tl::unexpected<Error> damaged(std::string message) const;

  /// The index of a topic, which may be new. Errors: `corrupt_data` for a new topic after finish.
  [[nodiscard]] Result<std::uint32_t> topic(const Topic& topic);
  /// Loads a chunk to learn its content, and keeps it.
  [[nodiscard]] Result<void> learn(Chunk chunk);
  /// Learns a run of messages outside of chunks, if there are some, and begins the next one.
  [[nodiscard]] Result<void> end_run(Chunk& run);
  void keep(Chunk chunk) { chunks_.push_back(std::move(chunk)); }
  /// Forgets everything that was found.
  void start_over();
  /// Starts reading. @param counted  the chunks say how many messages each topic has
  void finish(std::string format, bool counted);
  /// Sets the error that next() returns after the last message.
  void end_with(Error error) { ending_ = std::move(error); }

  [[nodiscard]] const InputFile& input() const noexcept { return file_; }
  [[nodiscard]] FileWindow& window() noexcept { return window_; }
  /// States how many messages a topic has.
  void count(std::uint32_t topic, std::uint64_t messages) { topics_[topic].messages = messages; }

 private:
  [[nodiscard]] bool is_wanted(const Chunk& chunk) const noexcept;
  /// The content of a chunk and its messages in the order of their log times.
  [[nodiscard]] Result<void> load(const Chunk& chunk, Content& content);
  [[nodiscard]] Result<void> open(const Chunk& chunk);
  [[nodiscard]] Result<void> check(const Chunk& chunk) const;
  void rewind() noexcept;

  InputFile file_;
  FileWindow window_;
  Buffer packed_, unpacked_;
  std::uint64_t grown_ = 0;  // decompressed in this pass [bytes]
  std::string format_;
  std::vector<Topic> topics_;
  std::unordered_map<std::string, std::uint32_t> topic_indices_;
  bool is_finished_ = false;
  std::vector<std::uint64_t> learned_;  // messages of each topic
  std::vector<Chunk> chunks_;
  std::optional<Error> ending_, failure_;
  std::vector<bool> selected_;
  std::int64_t from_ = 0;
  Content content_;
  std::size_t next_chunk_ = 0, next_message_ = 0;
};

/// How many bytes of messages outside of chunks are read together, unless one message is larger.
inline constexpr std::uint64_t kLargestRun = std::uint64_t{1} << 20;

}  // namespace vantage::io::ros
