#include "vantage/io/scan_source.hpp"

#include <algorithm>
#include <string>
#include <system_error>
#include <utility>

#include "io/folder_scans.hpp"
#include "io/formats.hpp"
#include "io/ros/bag_scans.hpp"
#include "io/ros/message_reader.hpp"
#include "io/velodyne/packet_scans.hpp"
#include "vantage/kit/file_content.hpp"

namespace vantage::io {
namespace {

constexpr std::size_t kHead = 64;  // [bytes]; enough to tell formats by

/// The beginning of a file; nothing for a path that is not a file, or for an empty file.
Result<std::string> head_of(const std::filesystem::path& path) {
  std::error_code error;
  if (!std::filesystem::is_regular_file(path, error)) return std::string();
  auto file = InputFile::open(path, "scans");
  if (!file && file.error().code == ErrorCode::corrupt_data) return std::string();  // empty
  if (!file) return fail(std::move(file).error());
  std::string head(std::min(file->size(), kHead), '\0');
  VANTAGE_CHECK(file->read(0, head));
  return head;
}

}  // namespace

Result<std::unique_ptr<ScanSource>> open_scans(const ScanOptions& options) {
  const SourceLocation where{options.path.string(), 0, 0};
  std::error_code error;
  if (!std::filesystem::exists(options.path, error)) {
    return fail(ErrorCode::not_found, "no such file or directory, expected scans", where);
  }
  VANTAGE_TRY(const std::string head, head_of(options.path));
  const Format* const capture = find_format(
      [&](const Format& format) { return format.open_capture != nullptr && format.probe(head); });
  if (capture != nullptr) {
    VANTAGE_CHECK(velodyne::check_packet_options(options));
    VANTAGE_TRY(auto file, InputFile::open(options.path, "a capture"));
    return capture->open_capture(std::move(file), options.topic);
  }
  VANTAGE_TRY(const bool bag, ros::is_bag(options.path));
  if (bag) {
    VANTAGE_TRY(auto reader, ros::open_bag(options.path));
    return ros::bag_scans(std::move(reader), options);
  }
  if (!options.topic.empty()) {
    return fail(ErrorCode::invalid_input,
                "files of single scans have no topics, so none can be chosen", where);
  }
  if (options.tags != Tags::all) {
    return fail(ErrorCode::invalid_input,
                "tags are read of messages only, so no points of files can be left out by them",
                where);
  }
  VANTAGE_TRY(auto sequence, ScanSequence::open(options.path, options.rate_hz, options.stamped));
  return folder_scans(std::move(sequence));
}

}  // namespace vantage::io
