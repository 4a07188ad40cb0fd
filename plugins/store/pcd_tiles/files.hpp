#pragma once

#include <filesystem>
#include <string>
#include <string_view>
#include <utility>

#include "vantage/result.hpp"

namespace vantage::pcd_tiles {

/// An open file, closed when the object goes.
class Descriptor {
 public:
  explicit Descriptor(int fd = -1) noexcept : fd_(fd) {}
  Descriptor(Descriptor&& other) noexcept : fd_(std::exchange(other.fd_, -1)) {}
  Descriptor& operator=(Descriptor&& other) noexcept {
    std::swap(fd_, other.fd_);
    return *this;
  }
  Descriptor(const Descriptor&) = delete;
  Descriptor& operator=(const Descriptor&) = delete;
  ~Descriptor();
  [[nodiscard]] int get() const noexcept { return fd_; }
  [[nodiscard]] bool open() const noexcept { return fd_ >= 0; }

 private:
  int fd_;
};

/// An `io_failure` at `path`, with the system's reason.
[[nodiscard]] tl::unexpected<Error> system_error(const std::filesystem::path& path,
                                                 const std::string& what, int error_number);

/// Errors: `not_found`; `io_failure`, also for something that is not a regular file.
[[nodiscard]] Result<std::string> read_file(const std::filesystem::path& path);

/// A file that is created or replaced. It is removed again unless it was written completely.
class OutputFile {
 public:
  /// Errors: `io_failure`.
  [[nodiscard]] static Result<OutputFile> create(const std::filesystem::path& path);
  OutputFile(OutputFile&& other) noexcept
      : path_(std::exchange(other.path_, {})), file_(std::move(other.file_)) {}
  OutputFile& operator=(OutputFile&&) = delete;
  ~OutputFile();

  /// Errors: `io_failure`.
  [[nodiscard]] Result<void> write(std::string_view content) const;
  /// Keeps the file, which is now complete.
  void keep() noexcept { path_.clear(); }

 private:
  OutputFile(const std::filesystem::path& path, Descriptor file)
      : path_(path), file_(std::move(file)) {}

  std::filesystem::path path_;
  Descriptor file_;
};

/// Makes everything in a folder survive a power cut. Errors: `io_failure`.
[[nodiscard]] Result<void> flush_folder(const std::filesystem::path& folder);

/// Errors: `already_exists` if `to` exists; `io_failure`.
[[nodiscard]] Result<void> rename_to_new(const std::filesystem::path& from,
                                         const std::filesystem::path& to);

/// Exchanges the names of two folders, in one step if the file system can do so. Errors:
/// `io_failure`; both folders are then unchanged.
[[nodiscard]] Result<void> exchange(const std::filesystem::path& a, const std::filesystem::path& b);

}  // namespace vantage::pcd_tiles
