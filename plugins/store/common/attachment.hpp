#pragma once

#include <cstddef>
#include <filesystem>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "common/bundle_format.hpp"
#include "vantage/result.hpp"

/// The file `<name>.dat` of an attachment: a line that says what it is, the bytes, and the XXH64 of
/// both (8 bytes, little endian).
namespace vantage::bundle_folder {

inline constexpr std::string_view kAttachment = ".dat";

/// Errors: `invalid_input` for a name that MapStore::attach does not allow.
[[nodiscard]] Result<std::string> attachment_name(std::string_view name);
[[nodiscard]] std::string encode_attachment(const BundleFormat& format,
                                            std::span<const std::byte> bytes);
/// Errors: `corrupt_data` for what encode_attachment does not make.
[[nodiscard]] Result<std::vector<std::byte>> decode_attachment(const BundleFormat& format,
                                                               std::string_view content,
                                                               const std::filesystem::path& file);
/// Whether a file says that it is an attachment.
[[nodiscard]] bool is_attachment(const BundleFormat& format, const std::filesystem::path& file);

}  // namespace vantage::bundle_folder
