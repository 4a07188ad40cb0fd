#pragma once

#include <filesystem>
#include <optional>
#include <string>
#include <string_view>

#include "vantage/kit/file_system.hpp"
#include "vantage/result.hpp"

namespace vantage::io {

/// A file that appears under its name only when it is complete. The content goes to a temporary
/// file in the same folder; commit() flushes that file to the disk and renames it. Without a
/// commit, nothing is left behind and an older file of that name is unchanged.
class OutputFile {
 public:
  /// Errors: `not_found` if the folder does not exist; `io_failure` if the folder cannot be written
  /// to or `path` names something other than a regular file.
  [[nodiscard]] static Result<OutputFile> create(const std::filesystem::path& path);

  OutputFile(OutputFile&& other) noexcept;
  OutputFile& operator=(OutputFile&& other) noexcept;
  OutputFile(const OutputFile&) = delete;
  OutputFile& operator=(const OutputFile&) = delete;
  ~OutputFile();

  /// Appends, through a buffer. Errors: `io_failure`; `invalid_input` after commit().
  [[nodiscard]] Result<void> write(std::string_view content);

  /// Flushes the content to the disk, still under the temporary name. Of several files that belong
  /// together, all can thus be finished before the first is committed.
  /// Errors: those of write.
  [[nodiscard]] Result<void> finish();

  /// Puts the file in place; call once, at the end.
  /// Errors: `io_failure`, also for a write that failed earlier; nothing is then left behind.
  [[nodiscard]] Result<void> commit();

 private:
  OutputFile() = default;
  [[nodiscard]] Result<void> flush();
  [[nodiscard]] tl::unexpected<Error> abandon(std::string message);
  void discard() noexcept;

  std::filesystem::path path_, temporary_;
  Descriptor descriptor_;  // open exactly while this object has to remove the temporary file
  std::string buffer_;
  std::optional<Error> failure_;
};

/// Whether OutputFile gives its temporary files names of this form. One is left by a process that
/// is killed.
[[nodiscard]] constexpr bool is_temporary(std::string_view name) noexcept {
  return name.starts_with(".vantage-") && name.ends_with(".tmp");
}

/// Writes the whole content in one call. Errors: those of OutputFile.
[[nodiscard]] Result<void> write_text_atomically(const std::filesystem::path& path,
                                                 std::string_view content);

}  // namespace vantage::io
