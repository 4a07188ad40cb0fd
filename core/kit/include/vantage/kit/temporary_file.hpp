#pragma once

#include <filesystem>

#include "vantage/kit/file_system.hpp"
#include "vantage/result.hpp"

namespace vantage::io {

/// An empty file beside the one that it is to become. Whoever has it renames or removes it.
struct TemporaryFile {
  std::filesystem::path path;  ///< see is_temporary
  Descriptor descriptor;       ///< open for writing
};

/// Errors: `not_found` if the folder of `target` does not exist; `io_failure` if the folder cannot
/// be written to or `target` names something other than a regular file.
[[nodiscard]] Result<TemporaryFile> create_temporary_for(const std::filesystem::path& target);

}  // namespace vantage::io
