#include "io/ros/growing_file.hpp"

#include <fcntl.h>
#include <unistd.h>

#include <cerrno>
#include <utility>

#include "vantage/kit/temporary_file.hpp"

namespace vantage::io::ros {

Result<GrowingFile> GrowingFile::create(const std::filesystem::path& path) {
  VANTAGE_TRY(TemporaryFile created, create_temporary_for(path));
  GrowingFile file;
  file.path_ = path;
  file.temporary_ = std::move(created.path);
  file.descriptor_ = std::move(created.descriptor);
  return file;
}

/// The other one removes what this one has not put in place.
GrowingFile& GrowingFile::operator=(GrowingFile&& other) noexcept {
  path_.swap(other.path_);
  temporary_.swap(other.temporary_);
  descriptor_ = std::move(other.descriptor_);
  std::swap(size_, other.size_);
  std::swap(reserved_, other.reserved_);
  return *this;
}

GrowingFile::~GrowingFile() {
  if (!descriptor_.open()) return;
  descriptor_.close();
  ::unlink(temporary_.c_str());
}

/// Returns 0, or an errno value if the disk is full. A file system that cannot reserve room counts
/// as one that has it. Only the new part is asked for, so a failure keeps what was reserved before.
int GrowingFile::reserve(std::uint64_t end) noexcept {
  if (end <= reserved_) return 0;
  int result = 0;
  do {
    result = ::fallocate(descriptor_.get(), FALLOC_FL_KEEP_SIZE, static_cast<off_t>(reserved_),
                         static_cast<off_t>(end - reserved_));
  } while (result != 0 && errno == EINTR);
  if (result != 0) return errno == ENOSPC || errno == EDQUOT ? errno : 0;
  reserved_ = end;
  return 0;
}

Result<void> GrowingFile::append(std::string_view bytes, std::uint64_t room) {
  if (!descriptor_.open()) {
    return fail(ErrorCode::invalid_input, "write to an output file that is already in place",
                SourceLocation{path_.string(), 0, 0});
  }
  int reason = reserve(size_ + bytes.size() + room);
  if (reason == 0) reason = write_all(descriptor_, bytes);
  if (reason == 0) {
    size_ += bytes.size();
    return {};
  }
  // The next bytes go over what was written in part, or commit() cuts it off.
  (void)::lseek(descriptor_.get(), static_cast<off_t>(size_), SEEK_SET);
  return system_error(path_, "writing failed", reason);
}

Result<void> GrowingFile::commit() {
  if (!descriptor_.open()) {
    return fail(ErrorCode::invalid_input, "commit of an output file that is already in place",
                SourceLocation{path_.string(), 0, 0});
  }
  if (::ftruncate(descriptor_.get(), static_cast<off_t>(size_)) != 0 ||
      ::fsync(descriptor_.get()) != 0) {
    return system_error(path_, "writing to the disk failed", errno);
  }
  if (::rename(temporary_.c_str(), path_.c_str()) != 0) {
    return system_error(path_, "the finished file cannot be put in place", errno);
  }
  descriptor_.close();
  return flush_name(path_);
}

}  // namespace vantage::io::ros
