#pragma once

#include <cstddef>
#include <filesystem>
#include <memory>
#include <string>
#include <string_view>

#include "vantage/result.hpp"

namespace vantage::io {

/// All bytes of one file.
struct FileContent {
  std::unique_ptr<char[]> bytes;
  std::size_t size = 0;

  [[nodiscard]] std::string_view view() const noexcept { return {bytes.get(), size}; }
};

/// Reads a regular, non-empty file in one go; `expected` completes "expected ..." in messages.
/// Errors (`where` is the file): `not_found`; `io_failure`; `corrupt_data` for an empty file.
[[nodiscard]] Result<FileContent> read_file(const std::filesystem::path& path,
                                            std::string_view expected);

/// The system's words for an errno value.
[[nodiscard]] std::string system_message(int error_number);

}  // namespace vantage::io
