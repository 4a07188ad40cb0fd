#include "vantage/kit/atomic_file.hpp"

#include <unistd.h>

#include <cerrno>
#include <cstdio>
#include <utility>

#include "vantage/kit/temporary_file.hpp"

namespace vantage::io {
namespace {

constexpr std::size_t kBufferSize = std::size_t{1} << 16;

}  // namespace

Result<OutputFile> OutputFile::create(const std::filesystem::path& path) {
  VANTAGE_TRY(TemporaryFile created, create_temporary_for(path));
  OutputFile file;
  file.path_ = path;
  file.temporary_ = std::move(created.path);
  file.descriptor_ = std::move(created.descriptor);
  file.buffer_.reserve(kBufferSize);
  return file;
}

OutputFile::OutputFile(OutputFile&& other) noexcept
    : path_(std::move(other.path_)),
      temporary_(std::move(other.temporary_)),
      descriptor_(std::move(other.descriptor_)),
      buffer_(std::move(other.buffer_)),
      failure_(std::move(other.failure_)) {}

OutputFile& OutputFile::operator=(OutputFile&& other) noexcept {
  if (this == &other) return *this;
  discard();
  path_ = std::move(other.path_);
  temporary_ = std::move(other.temporary_);
  descriptor_ = std::move(other.descriptor_);
  buffer_ = std::move(other.buffer_);
  failure_ = std::move(other.failure_);
  return *this;
}

OutputFile::~OutputFile() { discard(); }

void OutputFile::discard() noexcept {
  if (!descriptor_.open()) return;
  descriptor_.close();
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
  if (const int reason = write_all(descriptor_, buffer_); reason != 0) {
    return abandon("writing failed (" + system_message(reason) + ")");
  }
  buffer_.clear();
  return {};
}

Result<void> OutputFile::write(std::string_view content) {
  if (failure_) return fail(*failure_);
  if (!descriptor_.open()) {
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

Result<void> OutputFile::finish() {
  if (failure_) return fail(*failure_);
  if (!descriptor_.open()) {
    return fail(ErrorCode::invalid_input, "commit of an output file that is already in place",
                SourceLocation{path_.string(), 0, 0});
  }
  VANTAGE_CHECK(flush());
  if (::fsync(descriptor_.get()) != 0) {
    return abandon("writing to the disk failed (" + system_message(errno) + ")");
  }
  return {};
}

Result<void> OutputFile::commit() {
  VANTAGE_CHECK(finish());
  if (::rename(temporary_.c_str(), path_.c_str()) != 0) {
    return abandon("the finished file cannot be put in place (" + system_message(errno) + ")");
  }
  descriptor_.close();
  return flush_name(path_);
}

Result<void> write_text_atomically(const std::filesystem::path& path, std::string_view content) {
  VANTAGE_TRY(auto file, OutputFile::create(path));
  VANTAGE_CHECK(file.write(content));
  return file.commit();
}

}  // namespace vantage::io
