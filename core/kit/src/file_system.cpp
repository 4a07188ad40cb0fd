#include "vantage/kit/file_system.hpp"

#include <fcntl.h>
#include <sys/file.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <cstdio>
#include <system_error>

namespace vantage::io {
namespace {

bool not_supported(int error_number) {
  return error_number == EINVAL || error_number == ENOSYS || error_number == EOPNOTSUPP;
}

}  // namespace

Descriptor Descriptor::of(const std::filesystem::path& path, int flags) noexcept {
  int fd = -1;
  do {
    fd = ::open(path.c_str(), flags | O_CLOEXEC, 0666);
  } while (fd < 0 && errno == EINTR);
  return Descriptor(fd);
}

void Descriptor::close() noexcept {
  if (fd_ >= 0) ::close(std::exchange(fd_, -1));
}

int Descriptor::finish() noexcept {
  // Whatever it answers, the descriptor is closed.
  return ::close(std::exchange(fd_, -1)) == 0 || errno == EINTR ? 0 : errno;
}

std::string system_message(int error_number) {
  return std::generic_category().message(error_number);
}

tl::unexpected<Error> system_error(const std::filesystem::path& path, const std::string& what,
                                   int error_number) {
  return fail(ErrorCode::io_failure, what + " (" + system_message(error_number) + ")",
              SourceLocation{path.string(), 0, 0});
}

int write_all(const Descriptor& file, std::string_view content) noexcept {
  while (!content.empty()) {
    const ssize_t written = ::write(file.get(), content.data(), content.size());
    if (written < 0 && errno == EINTR) continue;
    if (written < 0) return errno;
    content.remove_prefix(static_cast<std::size_t>(written));
  }
  return 0;
}

int read_all(const Descriptor& file, std::size_t offset, std::span<char> bytes,
             std::size_t& done) noexcept {
  for (done = 0; done < bytes.size();) {
    const ssize_t got = ::pread(file.get(), bytes.data() + done, bytes.size() - done,
                                static_cast<off_t>(offset + done));
    if (got < 0 && errno == EINTR) continue;
    if (got < 0) return errno;
    if (got == 0) return 0;
    done += static_cast<std::size_t>(got);
  }
  return 0;
}

int flush_content(const Descriptor& file) noexcept {
  return ::fdatasync(file.get()) == 0 ? 0 : errno;
}

int lock_file(const Descriptor& file, Wait wait) noexcept {
  int result = 0;
  do {
    result = ::flock(file.get(), wait == Wait::yes ? LOCK_EX : LOCK_EX | LOCK_NB);
  } while (result != 0 && errno == EINTR);
  return result == 0 ? 0 : errno;
}

Result<std::vector<std::string>> names_in(const std::filesystem::path& folder) {
  std::vector<std::string> names;
  std::error_code error;
  for (std::filesystem::directory_iterator it(folder, error), end; !error && it != end;
       it.increment(error)) {
    names.push_back(it->path().filename().string());
  }
  if (error) return system_error(folder, "the folder cannot be listed", error.value());
  std::ranges::sort(names);
  return names;
}

std::uint64_t bytes_of(const std::filesystem::path& path) {
  std::error_code error;
  if (!std::filesystem::is_directory(path, error)) {
    const auto size = std::filesystem::file_size(path, error);
    return error ? 0 : size;
  }
  std::uint64_t sum = 0;
  for (std::filesystem::recursive_directory_iterator it(path, error), end; !error && it != end;
       it.increment(error)) {
    std::error_code unreadable;
    const auto size = it->is_regular_file(unreadable) ? it->file_size(unreadable) : 0;
    if (!unreadable) sum += size;
  }
  return sum;
}

Result<void> flush_folder(const std::filesystem::path& folder) {
  const Descriptor handle = Descriptor::of(folder, O_RDONLY | O_DIRECTORY);
  if (!handle.open() || ::syncfs(handle.get()) != 0) {
    return system_error(folder, "the folder cannot be written to the disk", errno);
  }
  return {};
}

Result<void> flush_name(const std::filesystem::path& path) {
  const std::filesystem::path above = path.has_parent_path() ? path.parent_path() : ".";
  const Descriptor folder = Descriptor::of(above, O_RDONLY | O_DIRECTORY);
  if (folder.open() && ::fsync(folder.get()) == 0) return {};
  // A folder may be written to that may not be read.
  if (not_supported(errno) || errno == EACCES) return {};
  return system_error(path, "its name cannot be written to the disk", errno);
}

Result<void> rename_to_new(const std::filesystem::path& from, const std::filesystem::path& to) {
  int result = ::renameat2(AT_FDCWD, from.c_str(), AT_FDCWD, to.c_str(), RENAME_NOREPLACE);
  // A plain rename would replace an empty folder, but never a folder with content.
  if (result != 0 && not_supported(errno)) result = ::rename(from.c_str(), to.c_str());
  if (result == 0) return {};
  const int reason = errno;
  if (reason == EEXIST || reason == ENOTEMPTY || reason == ENOTDIR) {
    return fail(ErrorCode::already_exists, "something of that name has appeared meanwhile",
                SourceLocation{to.string(), 0, 0});
  }
  return system_error(to, "the finished folder cannot be put in place", reason);
}

Result<void> exchange(const std::filesystem::path& a, const std::filesystem::path& b) {
  if (::renameat2(AT_FDCWD, a.c_str(), AT_FDCWD, b.c_str(), RENAME_EXCHANGE) == 0) return {};
  if (!not_supported(errno)) return system_error(b, "the folder cannot be replaced", errno);
  const std::filesystem::path aside = b.string() + ".replaced";
  if (::rename(b.c_str(), aside.c_str()) != 0) {
    return system_error(b, "the folder cannot be replaced", errno);
  }
  if (::rename(a.c_str(), b.c_str()) != 0) {
    const int reason = errno;
    (void)::rename(aside.c_str(), b.c_str());
    return system_error(b, "the folder cannot be replaced", reason);
  }
  if (::rename(aside.c_str(), a.c_str()) != 0) {
    return system_error(aside, "the replaced folder is left here", errno);
  }
  return {};
}

}  // namespace vantage::io
