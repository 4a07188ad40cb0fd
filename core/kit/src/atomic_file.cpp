#include "vantage/kit/atomic_file.hpp"

#include <fcntl.h>
#include <fmt/format.h>
#include <sys/stat.h>
#include <unistd.h>

#include <cerrno>
#include <cstdio>
#include <utility>

#include "vantage/kit/file_content.hpp"

namespace vantage::io {
namespace {

constexpr std::size_t kBufferSize = std::size_t{1} << 18;

}  // namespace

Result<OutputFile> OutputFile::create(const std::filesystem::path& path) {
  const SourceLocation where{path.string(), 0, 0};
  struct stat status {};
  if (path.filename().empty() || (::stat(path.c_str(), &status) == 0 && !S_ISREG(status.st_mode))) {
    return fail(ErrorCode::io_failure, "cannot be written: it is not a regular file", where);
  }
  OutputFile file;
  file.path_ = path;
  const std::filesystem::path folder = path.has_parent_path() ? path.parent_path() : ".";
  for (unsigned attempt = 0; file.descriptor_ < 0; ++attempt) {
    file.temporary_ = folder / fmt::format(".vantage-{}-{}.tmp", ::getpid(), attempt);
    file.descriptor_ =
        ::open(file.temporary_.c_str(), O_WRONLY | O_CREAT | O_EXCL | O_CLOEXEC, 0666);
    if (file.descriptor_ >= 0 || errno == EEXIST || errno == EINTR) continue;
    const int reason = errno;
    return fail(
        reason == ENOENT || reason == ENOTDIR ? ErrorCode::not_found : ErrorCode::io_failure,
        fmt::format("cannot be written: no file can be created in the folder {} ({})",
                    folder.string(), system_message(reason)),
        where);
  }
  file.buffer_.reserve(kBufferSize);
  return file;
}

OutputFile::OutputFile(OutputFile&& other) noexcept
    : path_(std::move(other.path_)),
      temporary_(std::move(other.temporary_)),
      descriptor_(std::exchange(other.descriptor_, -1)),
      buffer_(std::move(other.buffer_)),
      failure_(std::move(other.failure_)) {}

OutputFile& OutputFile::operator=(OutputFile&& other) noexcept {
  if (this == &other) return *this;
  discard();
  path_ = std::move(other.path_);
  temporary_ = std::move(other.temporary_);
  descriptor_ = std::exchange(other.descriptor_, -1);
  buffer_ = std::move(other.buffer_);
  failure_ = std::move(other.failure_);
  return *this;
}

OutputFile::~OutputFile() { discard(); }

void OutputFile::discard() noexcept {
  if (descriptor_ < 0) return;
  ::close(std::exchange(descriptor_, -1));
  ::unlink(temporary_.c_str());
}

tl::unexpected<Error> OutputFile::abandon(std::string message) {
  discard();
  failure_ = Error{.code = ErrorCode::io_failure,
                   .message = std::move(message),
                   .where = SourceLocation{path_.string(), 0, 0},
                   .context = {}};
  return fail(*failure_);
}

Result<void> OutputFile::flush() {
  std::string_view rest = buffer_;
  while (!rest.empty()) {
    const ssize_t written = ::write(descriptor_, rest.data(), rest.size());
    if (written < 0 && errno == EINTR) continue;
    if (written < 0) return abandon(fmt::format("writing failed ({})", system_message(errno)));
    rest.remove_prefix(static_cast<std::size_t>(written));
  }
  buffer_.clear();
  return {};
}

Result<void> OutputFile::write(std::string_view content) {
  if (failure_) return fail(*failure_);
  if (descriptor_ < 0) {
    return fail(ErrorCode::invalid_input, "write to an output file that is already in place",
                SourceLocation{path_.string(), 0, 0});
  }
  while (!content.empty()) {
    const std::string_view part = content.substr(0, kBufferSize - buffer_.size());
    buffer_ += part;
    content.remove_prefix(part.size());
    if (buffer_.size() == kBufferSize) VANTAGE_CHECK(flush());
  }
  return {};
}

Result<void> OutputFile::commit() {
  if (failure_) return fail(*failure_);
  if (descriptor_ < 0) {
    return fail(ErrorCode::invalid_input, "commit of an output file that is already in place",
                SourceLocation{path_.string(), 0, 0});
  }
  VANTAGE_CHECK(flush());
  if (::fsync(descriptor_) != 0) {
    return abandon(fmt::format("writing to the disk failed ({})", system_message(errno)));
  }
  if (::rename(temporary_.c_str(), path_.c_str()) != 0) {
    return abandon(
        fmt::format("the finished file cannot be put in place ({})", system_message(errno)));
  }
  ::close(std::exchange(descriptor_, -1));
  // Makes the new name itself survive a power cut. It is not an error if the folder cannot be
  // synced.
  const std::filesystem::path folder = path_.has_parent_path() ? path_.parent_path() : ".";
  if (const int handle = ::open(folder.c_str(), O_RDONLY | O_DIRECTORY | O_CLOEXEC); handle >= 0) {
    ::fsync(handle);
    ::close(handle);
  }
  return {};
}

Result<void> write_text_atomically(const std::filesystem::path& path, std::string_view content) {
  VANTAGE_TRY(auto file, OutputFile::create(path));
  VANTAGE_CHECK(file.write(content));
  return file.commit();
}

}  // namespace vantage::io
