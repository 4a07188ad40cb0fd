#pragma once

#include <cstddef>
#include <filesystem>
#include <memory>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "io/ros/message_reader.hpp"
#include "vantage/kit/file_content.hpp"
#include "vantage/result.hpp"

namespace vantage::io::ros {

/// Refuses a bag without topics. Errors: `corrupt_data`; those of `reader`.
[[nodiscard]] Result<std::unique_ptr<MessageReader>> with_topics(
    Result<std::unique_ptr<MessageReader>> reader);

/// Which of the reader's topics are selected. Errors: those of MessageReader::select.
[[nodiscard]] Result<std::vector<bool>> selection(const MessageReader& reader,
                                                  const std::vector<std::size_t>& topics);

/// Makes a reader of that file, whose `open` reads what comes before the messages.
template <class Reader>
[[nodiscard]] Result<std::unique_ptr<MessageReader>> opened(InputFile file) {
  auto reader = std::make_unique<Reader>(std::move(file));
  VANTAGE_CHECK(reader->open());
  return reader;
}

/// "sensor_msgs/PointCloud2" for "sensor_msgs/msg/PointCloud2".
[[nodiscard]] std::string ros1_spelling(std::string_view type);

/// The readers of message_reader.hpp, without the requirement that there is a topic.
[[nodiscard]] Result<std::unique_ptr<MessageReader>> read_rosbag1(InputFile file);
[[nodiscard]] Result<std::unique_ptr<MessageReader>> read_rosbag2_sqlite(InputFile file);
[[nodiscard]] Result<std::unique_ptr<MessageReader>> read_mcap(InputFile file);
/// Precondition: `folder` is a folder. Errors: those of open_bag.
[[nodiscard]] Result<std::unique_ptr<MessageReader>> read_parts(
    const std::filesystem::path& folder);
/// Opens a file of any of the formats.
[[nodiscard]] Result<std::unique_ptr<MessageReader>> read_bag_file(
    const std::filesystem::path& path);
/// The parts of a rosbag2 in a folder in natural order, including compressed ones.
/// Errors: `not_found`, `io_failure`.
[[nodiscard]] Result<std::vector<std::filesystem::path>> bag_parts(
    const std::filesystem::path& folder);

}  // namespace vantage::io::ros
