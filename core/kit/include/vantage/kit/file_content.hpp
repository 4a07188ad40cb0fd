#pragma once

#include <cstddef>
#include <filesystem>
#include <memory>
#include <span>
#include <string>
#include <string_view>

#include "vantage/kit/file_system.hpp"
#include "vantage/result.hpp"

namespace vantage::io {

/// All bytes of one file.
struct FileContent {
  std::unique_ptr<char[]> bytes;
  std::size_t size = 0;

  [[nodiscard]] std::string_view view() const noexcept { return {bytes.get(), size}; }
};

/// A regular file, open for reading; or bytes in memory that stand for one.
class InputFile {
 public:
  enum class Empty : bool { refuse, accept };

  /// @param expected  completes "expected ..." in messages
  /// Errors (`where` is the file): `not_found`; `io_failure`; `corrupt_data` for an empty file
  /// with Empty::refuse.
  [[nodiscard]] static Result<InputFile> open(const std::filesystem::path& path,
                                              std::string_view expected,
                                              Empty empty = Empty::refuse);
  /// @param bytes  must outlive the object
  /// @param name   for errors
  [[nodiscard]] static InputFile of_memory(std::string_view bytes, std::string name);

  /// The path that was opened, or the name given to `of_memory`.
  [[nodiscard]] const std::string& name() const noexcept { return name_; }

  /// Whether the bytes are in memory (`of_memory`).
  [[nodiscard]] bool in_memory() const noexcept { return memory_ != nullptr; }
  /// The size at the time of opening [bytes].
  [[nodiscard]] std::size_t size() const noexcept { return size_; }
  /// Reads bytes.size() bytes from `offset` on. Errors: `io_failure`, also for a file that has
  /// shrunk.
  /// Thread safety: may run on one object from many threads at once.
  [[nodiscard]] Result<void> read(std::size_t offset, std::span<char> bytes) const;
  /// Reads the whole file. Errors: `io_failure`.
  [[nodiscard]] Result<FileContent> content() const;

 private:
  InputFile(Descriptor descriptor, std::size_t size, std::string name) noexcept;

  Descriptor descriptor_;  // none for bytes in memory
  std::size_t size_;
  std::string name_;
  const char* memory_ = nullptr;
};

/// Opens and reads a whole regular file. Parameters: those of InputFile::open.
/// Errors: those of InputFile::open and InputFile::content.
[[nodiscard]] Result<FileContent> read_file(const std::filesystem::path& path,
                                            std::string_view expected,
                                            InputFile::Empty empty = InputFile::Empty::refuse);

}  // namespace vantage::io
