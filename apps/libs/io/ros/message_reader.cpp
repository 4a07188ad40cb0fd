#include "io/ros/message_reader.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <array>

#include "io/file_suffix.hpp"
#include "io/formats.hpp"
#include "io/ros/bag_readers.hpp"
#include "io/ros/decompress.hpp"
#include "io/scan_sequence.hpp"

namespace vantage::io::ros {
namespace {

using Reader = Result<std::unique_ptr<MessageReader>>;

std::string any_bag() { return fmt::format("a bag ({})", bag_names()); }

bool is_part(const std::filesystem::path& path) { return has_extension_of(kBagPart, path); }

const Format* bag_format(std::string_view head) {
  return find_format(
      [&](const Format& format) { return format.open_bag != nullptr && format.probe(head); });
}

/// "bag_0.db3.zstd", as `ros2 bag record --compression-mode file` leaves it.
bool is_compressed_part(const std::filesystem::path& path) {
  const std::string suffix = lower_case_suffix(path);
  return (suffix == ".zstd" || suffix == ".zst") && is_part(path.stem());
}

Result<std::string> head_of(const InputFile& file) {
  std::array<char, 64> head{};
  const std::size_t size = std::min(head.size(), file.size());
  VANTAGE_CHECK(file.read(0, std::span(head).first(size)));
  return std::string(head.data(), size);
}

bool is_folder(const std::filesystem::path& path) noexcept {
  std::error_code ignored;
  return std::filesystem::is_directory(path, ignored);
}

}  // namespace

bool looks_like_rosbag1(std::string_view head) noexcept { return head.starts_with("#ROSBAG V"); }
bool looks_like_sqlite(std::string_view head) noexcept {
  return head.starts_with(std::string_view("SQLite format 3\0", 16));
}
bool looks_like_mcap(std::string_view head) noexcept { return head.starts_with("\x89MCAP"); }

Reader with_topics(Reader reader) {
  if (!reader || !(*reader)->topics().empty()) return reader;
  VANTAGE_TRY(const auto none, (*reader)->next());  // gives a better reason if the bag is damaged
  static_cast<void>(none);
  return fail(ErrorCode::corrupt_data, "the bag has no topic, expected at least one",
              SourceLocation{(*reader)->file(), 0, 0});
}

Result<std::vector<bool>> selection(const MessageReader& reader,
                                    const std::vector<std::size_t>& topics) {
  std::vector<bool> selected(reader.topics().size(), false);
  for (const std::size_t topic : topics) {
    if (topic >= selected.size()) {
      return fail(ErrorCode::invalid_input,
                  fmt::format("topic {} of {} cannot be selected", topic, selected.size()),
                  SourceLocation{reader.file(), 0, 0});
    }
    selected[topic] = true;
  }
  return selected;
}

std::string ros1_spelling(std::string_view type) {
  std::string spelled(type);
  if (const auto at = spelled.find("/msg/"); at != std::string::npos) spelled.erase(at, 4);
  return spelled;
}

Reader open_rosbag1(InputFile file) { return with_topics(read_rosbag1(std::move(file))); }
Reader open_rosbag2_sqlite(InputFile file) {
  return with_topics(read_rosbag2_sqlite(std::move(file)));
}
Reader open_mcap(InputFile file) { return with_topics(read_mcap(std::move(file))); }

Reader read_bag_file(const std::filesystem::path& path) {
  VANTAGE_TRY(auto file, InputFile::open(path, any_bag()));
  VANTAGE_TRY(const std::string head, head_of(file));
  if (const Format* format = bag_format(head)) return format->open_bag(std::move(file));
  const SourceLocation where{path.string(), 0, 0};
  if (head.starts_with(kZstdMagic) && is_compressed_part(path)) {
    return fail(ErrorCode::unsupported,
                fmt::format("the bag is compressed as a file, expected one that `zstd -d {}` has "
                            "decompressed",
                            path.filename().string()),
                where);
  }
  return fail(ErrorCode::corrupt_data,
              fmt::format("expected {}, the file begins like none", any_bag()), where);
}

Result<std::vector<std::filesystem::path>> bag_parts(const std::filesystem::path& folder) {
  std::vector<std::filesystem::path> parts;
  std::error_code error;
  for (std::filesystem::directory_iterator entry(folder, error), end; !error && entry != end;
       entry.increment(error)) {
    if (is_folder(entry->path())) continue;
    if (is_part(entry->path()) || is_compressed_part(entry->path())) parts.push_back(*entry);
  }
  if (error) {
    return fail(ErrorCode::io_failure, fmt::format("cannot be listed ({})", error.message()),
                SourceLocation{folder.string(), 0, 0});
  }
  std::sort(parts.begin(), parts.end(), [](const auto& a, const auto& b) {
    return less_by_natural_order(a.filename().string(), b.filename().string());
  });
  // A part that was decompressed beside its compressed file is there twice.
  const auto decompressed = [all = parts](const std::filesystem::path& part) {
    return is_compressed_part(part) &&
           std::find(all.begin(), all.end(), part.parent_path() / part.stem()) != all.end();
  };
  std::erase_if(parts, decompressed);
  return parts;
}

Reader open_bag(const std::filesystem::path& path) {
  return with_topics(is_folder(path) ? read_parts(path) : read_bag_file(path));
}

Result<bool> is_bag(const std::filesystem::path& path) {
  if (is_folder(path)) {
    VANTAGE_TRY(const auto parts, bag_parts(path));
    return !parts.empty();
  }
  const auto file = InputFile::open(path, any_bag());
  if (!file && file.error().code == ErrorCode::corrupt_data) return false;  // empty
  if (!file) return fail(file.error());
  VANTAGE_TRY(const std::string head, head_of(*file));
  return bag_format(head) != nullptr || (head.starts_with(kZstdMagic) && is_compressed_part(path));
}

}  // namespace vantage::io::ros
