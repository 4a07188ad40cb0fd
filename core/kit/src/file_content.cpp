#include "vantage/kit/file_content.hpp"

#include <fcntl.h>
#include <fmt/format.h>
#include <sys/stat.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <new>
#include <system_error>
#include <utility>

namespace vantage::io {
std::string system_message(int error_number) {
  return std::generic_category().message(error_number);
}

InputFile::InputFile(int descriptor, std::size_t size, std::string name) noexcept
    : descriptor_(descriptor), size_(size), name_(std::move(name)) {}
InputFile::InputFile(InputFile&& other) noexcept
    : descriptor_(std::exchange(other.descriptor_, -1)),
      size_(other.size_),
      name_(std::move(other.name_)),
      memory_(other.memory_) {}
InputFile InputFile::of_memory(std::string_view bytes, std::string name) {
  InputFile file(-1, bytes.size(), std::move(name));
  file.memory_ = bytes.data();
  return file;
}
InputFile::~InputFile() {
  if (descriptor_ >= 0) ::close(descriptor_);
}

Result<InputFile> InputFile::open(const std::filesystem::path& path, std::string_view expected) {
  const SourceLocation where{path.string(), 0, 0};
  // Non-blocking: otherwise opening a pipe without a writer would never return.
  InputFile file(::open(path.c_str(), O_RDONLY | O_CLOEXEC | O_NONBLOCK), 0, path.string());
  if (file.descriptor_ < 0) {
    const int reason = errno;
    const bool absent = reason == ENOENT || reason == ENOTDIR;
    return fail(absent ? ErrorCode::not_found : ErrorCode::io_failure,
                fmt::format("cannot be opened ({}), expected {}", system_message(reason), expected),
                where);
  }
  struct stat status {};
  if (::fstat(file.descriptor_, &status) != 0) {
    return fail(ErrorCode::io_failure,
                fmt::format("cannot be examined ({})", system_message(errno)), where);
  }
  if (!S_ISREG(status.st_mode)) {
    return fail(
        ErrorCode::io_failure,
        fmt::format("is {}, expected {}",
                    S_ISDIR(status.st_mode) ? "a directory" : "not a regular file", expected),
        where);
  }
  if (status.st_size <= 0) {
    return fail(ErrorCode::corrupt_data, fmt::format("the file is empty, expected {}", expected),
                where);
  }
  file.size_ = static_cast<std::size_t>(status.st_size);
  return file;
}

Result<void> InputFile::read(std::size_t offset, std::span<char> bytes) const {
  const SourceLocation where{name_, 0, 0};
  if (memory_ != nullptr && offset <= size_ && bytes.size() <= size_ - offset) {
    std::copy_n(memory_ + offset, bytes.size(), bytes.begin());
    return {};
  }
  while (!bytes.empty()) {
    const ssize_t got =
        ::pread(descriptor_, bytes.data(), bytes.size(), static_cast<off_t>(offset));
    if (got < 0 && errno == EINTR) continue;
    if (got < 0) {
      return fail(ErrorCode::io_failure,
                  fmt::format("reading failed at byte {} ({})", offset, system_message(errno)),
                  where);
    }
    if (got == 0) {
      return fail(
          ErrorCode::io_failure,
          fmt::format("the file shrank while it was read: ends at byte {}, expected {} bytes",
                      offset, size_),
          where);
    }
    offset += static_cast<std::size_t>(got);
    bytes = bytes.subspan(static_cast<std::size_t>(got));
  }
  return {};
}

Result<FileContent> InputFile::content() const {
  FileContent content;
  try {
    content.bytes = std::make_unique_for_overwrite<char[]>(size_);
  } catch (const std::bad_alloc&) {
    return fail(ErrorCode::io_failure,
                fmt::format("not enough memory to read the file's {} bytes", size_),
                SourceLocation{name_, 0, 0});
  }
  content.size = size_;
  VANTAGE_CHECK(read(0, {content.bytes.get(), size_}));
  return content;
}

Result<FileContent> read_file(const std::filesystem::path& path, std::string_view expected) {
  VANTAGE_TRY(const InputFile file, InputFile::open(path, expected));
  return file.content();
}

}  // namespace vantage::io
