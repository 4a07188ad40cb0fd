#include "common/attachment.hpp"

#include <algorithm>
#include <bit>
#include <cstring>

#include "vantage/kit/checksum.hpp"
#include "vantage/kit/file_content.hpp"

namespace vantage::bundle_folder {
namespace {

constexpr std::size_t kLongestName = 32;
static_assert(std::endian::native == std::endian::little);

std::string title_of(const BundleFormat& format) {
  return "vantage " + std::string(format.store) + " attachment\n";
}

}  // namespace

Result<std::string> attachment_name(std::string_view name) {
  const auto allowed = [](char c) { return (c >= 'a' && c <= 'z') || c == '_'; };
  if (name.empty() || name.size() > kLongestName || !std::ranges::all_of(name, allowed)) {
    return fail(ErrorCode::invalid_input,
                "an attachment's name has 1 to 32 lower-case letters and underscores, not '" +
                    std::string(name) + "'");
  }
  return std::string(name) + std::string(kAttachment);
}

std::string encode_attachment(const BundleFormat& format, std::span<const std::byte> bytes) {
  std::string content = title_of(format);
  content.append(reinterpret_cast<const char*>(bytes.data()), bytes.size());
  const std::uint64_t sum = checksum_of(content);
  content.append(reinterpret_cast<const char*>(&sum), sizeof(sum));
  return content;
}

Result<std::vector<std::byte>> decode_attachment(const BundleFormat& format,
                                                 std::string_view content,
                                                 const std::filesystem::path& file) {
  const auto corrupt = [&](const char* reason) {
    return fail(ErrorCode::corrupt_data, reason, SourceLocation{file.string(), 0, 0});
  };
  const std::string title = title_of(format);
  if (!content.starts_with(title)) return corrupt("this is not an attachment of a bundle");
  std::uint64_t sum = 0;
  if (content.size() < title.size() + sizeof(sum)) return corrupt("the file is cut off");
  const std::string_view body = content.substr(0, content.size() - sizeof(sum));
  std::memcpy(&sum, content.data() + body.size(), sizeof(sum));
  if (sum != checksum_of(body)) return corrupt("the checksum does not fit the content");
  const auto bytes = std::as_bytes(std::span(body.substr(title.size())));
  return std::vector<std::byte>(bytes.begin(), bytes.end());
}

bool is_attachment(const BundleFormat& format, const std::filesystem::path& file) {
  if (file.extension() != kAttachment) return false;
  const std::string expected = title_of(format);
  // Not a stream, which would wait for somebody who writes to a pipe.
  const auto opened = io::InputFile::open(file, "an attachment");
  std::string title(expected.size(), ' ');
  return opened && opened->size() >= title.size() && opened->read(0, title) && title == expected;
}

}  // namespace vantage::bundle_folder
