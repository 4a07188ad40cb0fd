#include "io/file_content.hpp"

#include <fcntl.h>
#include <fmt/format.h>
#include <sys/stat.h>
#include <unistd.h>

#include <cerrno>
#include <new>
#include <system_error>

namespace vantage::io {
namespace {

class Descriptor {
 public:
  explicit Descriptor(int value) noexcept : value_(value) {}
  ~Descriptor() {
    if (value_ >= 0) ::close(value_);
  }
  Descriptor(const Descriptor&) = delete;
  Descriptor& operator=(const Descriptor&) = delete;
  [[nodiscard]] int value() const noexcept { return value_; }

 private:
  int value_;
};

}  // namespace

std::string system_message(int error_number) {
  return std::generic_category().message(error_number);
}

Result<FileContent> read_file(const std::filesystem::path& path, std::string_view expected) {
  const SourceLocation where{path.string(), 0, 0};
  // Not blocking: opening a pipe that nobody writes to would otherwise never return.
  const Descriptor file(::open(path.c_str(), O_RDONLY | O_CLOEXEC | O_NONBLOCK));
  if (file.value() < 0) {
    const int reason = errno;
    const bool absent = reason == ENOENT || reason == ENOTDIR;
    return fail(absent ? ErrorCode::not_found : ErrorCode::io_failure,
                fmt::format("cannot be opened ({}), expected {}", system_message(reason), expected),
                where);
  }
  struct stat status {};
  if (::fstat(file.value(), &status) != 0) {
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

  FileContent content;
  const auto size = static_cast<std::size_t>(status.st_size);
  try {
    content.bytes = std::make_unique_for_overwrite<char[]>(size);
  } catch (const std::bad_alloc&) {
    return fail(ErrorCode::io_failure,
                fmt::format("not enough memory to read the file's {} bytes", size), where);
  }
  while (content.size < size) {
    const ssize_t got =
        ::read(file.value(), content.bytes.get() + content.size, size - content.size);
    if (got < 0 && errno == EINTR) continue;
    if (got < 0) {
      return fail(
          ErrorCode::io_failure,
          fmt::format("reading failed at byte {} ({})", content.size, system_message(errno)),
          where);
    }
    if (got == 0) break;
    content.size += static_cast<std::size_t>(got);
  }
  if (content.size < size) {
    return fail(ErrorCode::io_failure,
                fmt::format("the file shrank while it was read: ends at byte {}, expected {} bytes",
                            content.size, size),
                where);
  }
  return content;
}

}  // namespace vantage::io
