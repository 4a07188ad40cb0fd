#pragma once

#include <cstdint>
#include <filesystem>
#include <string_view>

#include "vantage/kit/file_system.hpp"
#include "vantage/result.hpp"

namespace vantage::io::ros {

/// A file that grows for hours, and that a full disk does not take away: what is appended is in it
/// whole or not at all, and room for its end can be kept. As OutputFile, it has a temporary name
/// until it is put in place, and leaves nothing without that.
class GrowingFile {
 public:
  /// Errors: those of create_temporary_for.
  [[nodiscard]] static Result<GrowingFile> create(const std::filesystem::path& path);
  GrowingFile(GrowingFile&& other) noexcept = default;
  GrowingFile& operator=(GrowingFile&& other) noexcept;
  ~GrowingFile();

  /// Appends. If that fails, the file is as it was, and may be put in place.
  /// @param room  bytes that later appends find on the disk then, if the file system can keep them
  /// Errors: `io_failure`; `invalid_input` after commit().
  [[nodiscard]] Result<void> append(std::string_view bytes, std::uint64_t room);
  /// Frees the room that is left and puts the file in place; call once. Errors: `io_failure`.
  [[nodiscard]] Result<void> commit();

 private:
  GrowingFile() = default;
  [[nodiscard]] int reserve(std::uint64_t end) noexcept;

  std::filesystem::path path_, temporary_;
  Descriptor descriptor_;  // open exactly while this object has to remove the temporary file
  std::uint64_t size_ = 0, reserved_ = 0;
};

}  // namespace vantage::io::ros
