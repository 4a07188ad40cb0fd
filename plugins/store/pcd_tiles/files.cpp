#include "files.hpp"

#include <fcntl.h>
#include <sys/stat.h>
#include <unistd.h>

#include <cerrno>
#include <cstdio>
#include <system_error>

namespace vantage::pcd_tiles {
namespace {

Descriptor open_file(const std::filesystem::path& path, int flags) {
  int fd = -1;
  do {
    fd = ::open(path.c_str(), flags | O_CLOEXEC, 0666);
  } while (fd < 0 && errno == EINTR);
  return Descriptor(fd);
}

bool not_supported(int error_number) {
  return error_number == EINVAL || error_number == ENOSYS || error_number == EOPNOTSUPP;
}

}  // namespace

Descriptor::~Descriptor() {
  if (fd_ >= 0) ::close(fd_);
}

tl::unexpected<Error> system_error(const std::filesystem::path& path, const std::string& what,
                                   int error_number) {
  return fail(ErrorCode::io_failure,
              what + " (" + std::generic_category().message(error_number) + ")",
              SourceLocation{path.string(), 0, 0});
}

Result<std::string> read_file(const std::filesystem::path& path) {
  const Descriptor file = open_file(path, O_RDONLY | O_NONBLOCK);
  if (!file.open()) {
    const int reason = errno;
    if (reason == ENOENT || reason == ENOTDIR) {
      return fail(ErrorCode::not_found, "the file does not exist",
                  SourceLocation{path.string(), 0, 0});
    }
    return system_error(path, "the file cannot be read", reason);
  }
  struct stat status {};
  if (::fstat(file.get(), &status) != 0)
    return system_error(path, "the file cannot be read", errno);
  if (!S_ISREG(status.st_mode)) {
    return fail(ErrorCode::io_failure, "this is no regular file",
                SourceLocation{path.string(), 0, 0});
  }
  std::string content(static_cast<std::size_t>(status.st_size), '\0');
  std::size_t have = 0;
  while (have < content.size()) {
    const ssize_t got = ::read(file.get(), content.data() + have, content.size() - have);
    if (got < 0 && errno == EINTR) continue;
    if (got < 0) return system_error(path, "the file cannot be read", errno);
    if (got == 0) break;
    have += static_cast<std::size_t>(got);
  }
  content.resize(have);
  return content;
}

Result<OutputFile> OutputFile::create(const std::filesystem::path& path) {
  Descriptor file = open_file(path, O_WRONLY | O_CREAT | O_TRUNC);
  if (!file.open()) return system_error(path, "the file cannot be created", errno);
  return OutputFile(path, std::move(file));
}

OutputFile::~OutputFile() {
  if (!path_.empty()) ::unlink(path_.c_str());
}

Result<void> OutputFile::write(std::string_view content) const {
  while (!content.empty()) {
    const ssize_t written = ::write(file_.get(), content.data(), content.size());
    if (written < 0 && errno == EINTR) continue;
    if (written < 0) return system_error(path_, "the file cannot be written", errno);
    content.remove_prefix(static_cast<std::size_t>(written));
  }
  return {};
}

Result<void> flush_folder(const std::filesystem::path& folder) {
  const Descriptor handle = open_file(folder, O_RDONLY | O_DIRECTORY);
  if (!handle.open() || ::syncfs(handle.get()) != 0) {
    return system_error(folder, "the folder cannot be written to the disk", errno);
  }
  return {};
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

}  // namespace vantage::pcd_tiles
