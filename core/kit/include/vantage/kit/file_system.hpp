#pragma once

#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <span>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "vantage/result.hpp"

/// Thin, checked system calls for the readers and writers of files.
namespace vantage::io {

/// An open file; the destructor closes it.
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
  ~Descriptor() { close(); }

  /// Opens a file or folder; retries if a signal interrupts. If opening fails, open() is false.
  /// @param flags  of open(2)
  [[nodiscard]] static Descriptor of(const std::filesystem::path& path, int flags) noexcept;

  [[nodiscard]] int get() const noexcept { return fd_; }
  [[nodiscard]] bool open() const noexcept { return fd_ >= 0; }
  void close() noexcept;
  /// Closes the file. Returns 0, or an errno value: some file systems refuse only now what was
  /// written.
  [[nodiscard]] int finish() noexcept;

 private:
  int fd_;
};

/// The system's message for an errno value.
[[nodiscard]] std::string system_message(int error_number);

/// `io_failure` at `path`, with the system's reason.
[[nodiscard]] tl::unexpected<Error> system_error(const std::filesystem::path& path,
                                                 const std::string& what, int error_number);

/// Writes all of `content`. Returns 0, or an errno value.
[[nodiscard]] int write_all(const Descriptor& file, std::string_view content) noexcept;

/// Reads bytes at an offset, until they are full or the file ends. Returns 0, or an errno value.
/// @param done  how many bytes were read
[[nodiscard]] int read_all(const Descriptor& file, std::size_t offset, std::span<char> bytes,
                           std::size_t& done) noexcept;

/// Makes what was written to a file survive a power cut. Returns 0, or an errno value.
[[nodiscard]] int flush_content(const Descriptor& file) noexcept;

enum class Wait : bool { no, yes };

/// Locks a file for this process, until its descriptor is closed. Returns 0, or an errno value:
/// EWOULDBLOCK if another process has the lock.
[[nodiscard]] int lock_file(const Descriptor& file, Wait wait) noexcept;

/// The names of the files and folders in a folder, sorted. Errors: `io_failure`.
[[nodiscard]] Result<std::vector<std::string>> names_in(const std::filesystem::path& folder);

/// The bytes of a file, or of all files in a folder; what cannot be read counts 0.
[[nodiscard]] std::uint64_t bytes_of(const std::filesystem::path& path);

/// Makes everything in a folder survive a power cut. Errors: `io_failure`.
[[nodiscard]] Result<void> flush_folder(const std::filesystem::path& folder);

/// Makes a new name in a folder survive a power cut, if the file system can do so. Errors:
/// `io_failure`.
[[nodiscard]] Result<void> flush_name(const std::filesystem::path& path);

/// Renames a folder. Errors: `already_exists` if `to` exists; `io_failure`.
[[nodiscard]] Result<void> rename_to_new(const std::filesystem::path& from,
                                         const std::filesystem::path& to);

/// Exchanges the names of two folders, in one step if the file system can do so. Errors:
/// `io_failure`. Both folders are then unchanged, unless the message says where `b` was left.
[[nodiscard]] Result<void> exchange(const std::filesystem::path& a, const std::filesystem::path& b);

}  // namespace vantage::io
