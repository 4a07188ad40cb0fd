#pragma once

#include <cstdint>
#include <filesystem>
#include <memory>
#include <optional>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "vantage/kit/file_content.hpp"
#include "vantage/result.hpp"

namespace vantage::io::ros {

/// How messages are encoded.
enum class Encoding : std::uint8_t {
  ros1,  ///< little endian, without padding
  cdr    ///< ROS 2: a 4-byte header that gives the byte order, aligned members
};

struct Topic {
  std::string name;  ///< "/points_raw"
  std::string type;  ///< ROS 1's spelling in any bag: "sensor_msgs/PointCloud2", not ".../msg/..."
  std::optional<Encoding> encoding;       ///< none for a topic that is only listed ("json")
  std::string encoding_name;              ///< "cdr", "ros1" or the bag's own word
  std::optional<std::uint64_t> messages;  ///< their number, if the bag says so
};

struct BagMessage {
  std::size_t topic = 0;      ///< index into topics()
  std::int64_t log_time = 0;  ///< when it was recorded [ns since the epoch]
  std::string_view bytes;     ///< valid until the next call of the reader
  /// The place in the file of the message, or of the compressed chunk that holds it [bytes]; 0 in a
  /// database.
  std::uint64_t offset = 0;
};

/// The messages of one bag in the order of their log times. If a bag has chunks, the chunks come in
/// the order of their first messages, and messages are sorted only within a chunk (chunks may
/// overlap a little in time). Memory use is that of a few messages, or of a chunk, whatever the
/// size of the bag; none may be larger than 1 GiB. Counts and sizes that the file states are
/// trusted only as far as the file's own size confirms them.
/// From a bag that is cut off or damaged, the reader gives the messages before the damage, then the
/// error.
class MessageReader {
 public:
  MessageReader() = default;
  virtual ~MessageReader() = default;
  MessageReader(const MessageReader&) = delete;
  MessageReader& operator=(const MessageReader&) = delete;

  /// "rosbag1 2.0 (lz4)", "rosbag2 (SQLite)", "MCAP (zstd)", with "not indexed" if that is the
  /// case.
  [[nodiscard]] virtual const std::string& format() const = 0;
  /// For a bag in parts, the part that next() read last.
  [[nodiscard]] virtual const std::string& file() const = 0;
  [[nodiscard]] virtual const std::vector<Topic>& topics() const = 0;
  /// First and last log time [ns], if the bag says so.
  [[nodiscard]] virtual std::optional<std::pair<std::int64_t, std::int64_t>> span() const = 0;
  /// Makes next() return only messages of these topics (indices into topics()), starting again at
  /// the beginning. Before the first call, all topics are selected. Errors: `invalid_input` for an
  /// index out of range.
  [[nodiscard]] virtual Result<void> select(const std::vector<std::size_t>& topics) = 0;
  /// The next message; nothing at the end. After an error, the same error again. Errors (`where` is
  /// the file, the message gives the byte and what was expected): `corrupt_data`, `io_failure`;
  /// `unsupported` for unknown compressions.
  [[nodiscard]] virtual Result<std::optional<BagMessage>> next() = 0;
  /// Makes next() continue with the first selected message recorded at or after `log_time` [ns],
  /// and leave out all messages that were recorded before.
  /// Errors: those of next().
  [[nodiscard]] virtual Result<void> seek(std::int64_t log_time) = 0;
};

/// Whether the beginning of a file (64 bytes are enough) is that of a bag.
[[nodiscard]] bool looks_like_rosbag1(std::string_view head) noexcept;
[[nodiscard]] bool looks_like_sqlite(std::string_view head) noexcept;
[[nodiscard]] bool looks_like_mcap(std::string_view head) noexcept;

/// Errors: those of MessageReader::next; also for a bag without a topic.
[[nodiscard]] Result<std::unique_ptr<MessageReader>> open_rosbag1(InputFile file);
[[nodiscard]] Result<std::unique_ptr<MessageReader>> open_rosbag2_sqlite(InputFile file);
[[nodiscard]] Result<std::unique_ptr<MessageReader>> open_mcap(InputFile file);

/// Opens a bag of any of these formats, or a folder that holds the parts of a rosbag2, which are
/// read one after the other. Errors: those of the readers above; `not_found`; `corrupt_data` for
/// any other file.
[[nodiscard]] Result<std::unique_ptr<MessageReader>> open_bag(const std::filesystem::path& path);

/// Whether open_bag can open `path`, judged by the content. Errors: `not_found`, `io_failure`.
[[nodiscard]] Result<bool> is_bag(const std::filesystem::path& path);

}  // namespace vantage::io::ros
