#include "vantage/kit/file_content.hpp"

#include <fcntl.h>
#include <sys/stat.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <new>
#include <utility>

namespace vantage::io {

InputFile::InputFile(Descriptor descriptor, std::size_t size, std::string name) noexcept
    : descriptor_(std::move(descriptor)), size_(size), name_(std::move(name)) {}

InputFile InputFile::of_memory(std::string_view bytes, std::string name) {
  InputFile file(Descriptor{}, bytes.size(), std::move(name));
  file.memory_ = bytes.data();
  return file;
}

Result<InputFile> InputFile::open(const std::filesystem::path& path, std::string_view expected,
                                  Empty empty) {
  const SourceLocation where{path.string(), 0, 0};
  // Not blocking: opening a pipe that nobody writes to would otherwise never return.
  InputFile file(Descriptor::of(path, O_RDONLY | O_NONBLOCK), 0, path.string());
  if (!file.descriptor_.open()) {
    const int reason = errno;
    const bool absent = reason == ENOENT || reason == ENOTDIR;
    return fail(
        absent ? ErrorCode::not_found : ErrorCode::io_failure,
        "cannot be opened (" + system_message(reason) + "), expected " + std::string(expected),
        where);
  }
  struct stat status {};
  if (::fstat(file.descriptor_.get(), &status) != 0) {
    return fail(ErrorCode::io_failure, "cannot be examined (" + system_message(errno) + ")", where);
  }
  if (!S_ISREG(status.st_mode)) {
    return fail(ErrorCode::io_failure,
                std::string("is ") +
                    (S_ISDIR(status.st_mode) ? "a directory" : "not a regular file") +
                    ", expected " + std::string(expected),
                where);
  }
  if (status.st_size <= 0 && empty == Empty::refuse) {
    return fail(ErrorCode::corrupt_data, "the file is empty, expected " + std::string(expected),
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
  std::size_t done = 0;
  if (const int error = read_all(descriptor_, offset, bytes, done); error != 0) {
    return fail(ErrorCode::io_failure,
                "reading failed at byte " + std::to_string(offset + done) + " (" +
                    system_message(error) + ")",
                where);
  }
  if (done < bytes.size()) {
    return fail(ErrorCode::io_failure,
                "the file shrank while it was read: ends at byte " + std::to_string(offset + done) +
                    ", expected " + std::to_string(size_) + " bytes",
                where);
  }
  return {};
}

Result<FileContent> InputFile::content() const {
  FileContent content;
  try {
    content.bytes = std::make_unique_for_overwrite<char[]>(size_);
  } catch (const std::bad_alloc&) {
    return fail(ErrorCode::io_failure,
                "not enough memory to read the file's " + std::to_string(size_) + " bytes",
                SourceLocation{name_, 0, 0});
  }
  content.size = size_;
  VANTAGE_CHECK(read(0, {content.bytes.get(), size_}));
  return content;
}

Result<FileContent> read_file(const std::filesystem::path& path, std::string_view expected,
                              InputFile::Empty empty) {
  VANTAGE_TRY(const InputFile file, InputFile::open(path, expected, empty));
  return file.content();
}

}  // namespace vantage::io
