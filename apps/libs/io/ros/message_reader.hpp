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

/// How messages are laid out.
enum class Encoding : std::uint8_t {
  ros1,  ///< little endian, nothing between the members
  cdr    ///< ROS 2: a header of 4 bytes that says the byte order, aligned members
};

struct Topic {
  std::string name;  ///< "/points_raw"
  std::string type;  ///< ROS 1's spelling in any bag: "sensor_msgs/PointCloud2", not ".../msg/..."
  std::optional<Encoding> encoding;       ///< none for one that is only listed ("json")
  std::string encoding_name;              ///< "cdr", "ros1" or the bag's own word
  std::optional<std::uint64_t> messages;  ///< how many, where the bag says so
};

struct BagMessage {
  std::size_t topic = 0;      ///< index into topics()
  std::int64_t log_time = 0;  ///< when it was recorded [ns since the epoch]
  std::string_view bytes;     ///< valid until the next call of the reader
  /// Where it is in the file, or the compressed chunk that holds it [bytes]; 0 in a database.
  std::uint64_t offset = 0;
};

/// The messages of one bag in the order of their log times; where a bag has chunks, these come in
/// the order of their first messages, and only within a chunk are messages sorted (chunks may
/// overlap a little in time). Memory is that of a few messages (of a chunk, where they are kept in
/// chunks; none may be larger than 1 GiB), whatever the size of the bag; counts and sizes that the
/// file states are believed only as far as its own size bears them out.
/// Of a bag that is cut off or damaged the messages before the damage are given, then the error.
class MessageReader {
 public:
  MessageReader() = default;
  virtual ~MessageReader() = default;
  MessageReader(const MessageReader&) = delete;
  MessageReader& operator=(const MessageReader&) = delete;

  /// "rosbag1 2.0 (lz4)", "rosbag2 (SQLite)", "MCAP (zstd)", with "not indexed" where it is so.
  [[nodiscard]] virtual const std::string& format() const = 0;
  /// Of a bag in parts the one that next() read last.
  [[nodiscard]] virtual const std::string& file() const = 0;
  [[nodiscard]] virtual const std::vector<Topic>& topics() const = 0;
  /// First and last log time [ns], where the bag says so.
  [[nodiscard]] virtual std::optional<std::pair<std::int64_t, std::int64_t>> span() const = 0;
  /// next() gives messages of these topics (indices into topics()) only, from the beginning on.
  /// All topics before the first call. Errors: `invalid_input` for an index out of range.
  [[nodiscard]] virtual Result<void> select(const std::vector<std::size_t>& topics) = 0;
  /// Nothing at the end; after an error the same again. Errors (`where` is the file, the message
  /// has the byte and what was expected): `corrupt_data`, `io_failure`; `unsupported` for
  /// compressions that are not known.
  [[nodiscard]] virtual Result<std::optional<BagMessage>> next() = 0;
  /// next() goes on with the first selected message recorded at or after `log_time` [ns] and leaves
  /// out all that were recorded before.
  /// Errors: those of next().
  [[nodiscard]] virtual Result<void> seek(std::int64_t log_time) = 0;
};

/// Whether a file's beginning (64 bytes are enough) is that of a bag.
[[nodiscard]] bool looks_like_rosbag1(std::string_view head) noexcept;
[[nodiscard]] bool looks_like_sqlite(std::string_view head) noexcept;
[[nodiscard]] bool looks_like_mcap(std::string_view head) noexcept;

/// Errors: those of MessageReader::next; also for a bag without a topic.
[[nodiscard]] Result<std::unique_ptr<MessageReader>> open_rosbag1(InputFile file);
[[nodiscard]] Result<std::unique_ptr<MessageReader>> open_rosbag2_sqlite(InputFile file);
[[nodiscard]] Result<std::unique_ptr<MessageReader>> open_mcap(InputFile file);

/// A bag of any of these formats, or a folder that holds the parts of a rosbag2, one after the
/// other. Errors: those of the readers above; `not_found`; `corrupt_data` for any other file.
[[nodiscard]] Result<std::unique_ptr<MessageReader>> open_bag(const std::filesystem::path& path);

/// Whether `path` is something for open_bag, from its content. Errors: `not_found`, `io_failure`.
[[nodiscard]] Result<bool> is_bag(const std::filesystem::path& path);

}  // namespace vantage::io::ros
