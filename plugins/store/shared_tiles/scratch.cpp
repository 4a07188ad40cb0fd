#include "scratch.hpp"

#include <fcntl.h>
#include <unistd.h>

#include <cerrno>
#include <utility>

namespace vantage::shared_tiles {

Result<Scratch::Place> Scratch::add(bundle_folder::PartialFolder& folder,
                                    std::string_view content) {
  if (!file_.open()) {
    VANTAGE_CHECK(folder.write_file(name_, std::string_view()));
    path_ = folder.path() / name_;
    file_ = io::Descriptor::of(path_, O_RDWR);
    if (!file_.open()) return io::system_error(path_, "the file cannot be opened", errno);
  }
  const Place place{size_, content.size()};
  while (!content.empty()) {
    const ssize_t written =
        ::pwrite(file_.get(), content.data(), content.size(), static_cast<off_t>(size_));
    if (written < 0 && errno == EINTR) continue;
    if (written < 0) return io::system_error(path_, "the file cannot be written", errno);
    size_ += static_cast<std::uint64_t>(written);
    content.remove_prefix(static_cast<std::size_t>(written));
  }
  return place;
}

Result<std::string> Scratch::read(const Place& place) const {
  std::string content(place.bytes, '\0');
  for (std::size_t at = 0; at < content.size();) {
    const ssize_t got = ::pread(file_.get(), content.data() + at, content.size() - at,
                                static_cast<off_t>(place.offset + at));
    if (got < 0 && errno == EINTR) continue;
    if (got < 0) return io::system_error(path_, "the file cannot be read", errno);
    if (got == 0) {
      return fail(ErrorCode::io_failure, "the file has become shorter", bundle_folder::at(path_));
    }
    at += static_cast<std::size_t>(got);
  }
  return content;
}

void Scratch::forget(const Place& place) noexcept {
  if (place.bytes == 0) return;
  (void)::fallocate(file_.get(), FALLOC_FL_PUNCH_HOLE | FALLOC_FL_KEEP_SIZE,
                    static_cast<off_t>(place.offset), static_cast<off_t>(place.bytes));
}

Result<void> Scratch::remove(bundle_folder::PartialFolder& folder) {
  if (!file_.open()) return {};
  file_.close();
  return folder.remove(name_);
}

}  // namespace vantage::shared_tiles
