// Preloaded into a program under test: makes calls to the disk fail, and records the calls that the
// program makes.
//
//   VANTAGE_DISK      words, with blanks between them:
//                       no_flags       renameat2 knows no flags, as on NFS
//                       no_locks       flock succeeds and locks nothing
//                       no_flush:TEXT  flushing a file whose path ends with TEXT fails
//                       no_close:TEXT  closing it fails
//   VANTAGE_DISK_LOG  a file that gets a line for every file that is flushed, renamed or removed
#include <dlfcn.h>
#include <fcntl.h>
#include <sys/syscall.h>
#include <unistd.h>

#include <array>
#include <cerrno>
#include <cstdlib>
#include <string>
#include <string_view>

namespace {

template <class Function>
Function next(const char* name) {
  return reinterpret_cast<Function>(::dlsym(RTLD_NEXT, name));
}

std::string path_of(int descriptor) {
  std::array<char, 4096> path{};
  const std::string link = "/proc/self/fd/" + std::to_string(descriptor);
  const ssize_t length = ::readlink(link.c_str(), path.data(), path.size());
  return {path.data(), length > 0 ? static_cast<std::size_t>(length) : 0};
}

/// Whether VANTAGE_DISK has the word `what`, or `what:TEXT` with an end of the path.
bool wanted(std::string_view what, const std::string& path = {}) {
  const char* const words = std::getenv("VANTAGE_DISK");
  std::string_view rest = words != nullptr ? words : "";
  while (!rest.empty()) {
    const std::string_view word = rest.substr(0, rest.find(' '));
    rest.remove_prefix(word.size() + (word.size() < rest.size() ? 1 : 0));
    if (word == what) return true;
    if (word.size() > what.size() && word.starts_with(what) && word[what.size()] == ':' &&
        path.ends_with(word.substr(what.size() + 1))) {
      return true;
    }
  }
  return false;
}

void note(const std::string& line) {
  const char* const log = std::getenv("VANTAGE_DISK_LOG");
  if (log == nullptr) return;
  const long file = ::syscall(SYS_openat, AT_FDCWD, log, O_WRONLY | O_CREAT | O_APPEND, 0600);
  if (file < 0) return;
  const std::string whole = line + "\n";
  (void)::syscall(SYS_write, file, whole.data(), whole.size());
  (void)::syscall(SYS_close, file);
}

int failing(int error) {
  errno = error;
  return -1;
}

int flush(const char* name, int descriptor) {
  const std::string path = path_of(descriptor);
  if (wanted("no_flush", path)) return failing(EIO);
  note("flush " + path);
  return next<int (*)(int)>(name)(descriptor);
}

}  // namespace

extern "C" {

int fsync(int descriptor) { return flush("fsync", descriptor); }
int fdatasync(int descriptor) { return flush("fdatasync", descriptor); }
int syncfs(int descriptor) noexcept { return flush("syncfs", descriptor); }

int close(int descriptor) {
  const std::string path = path_of(descriptor);
  const int done = next<int (*)(int)>("close")(descriptor);
  return wanted("no_close", path) ? failing(EIO) : done;
}

// Not by its name, which is a struct's, too.
int lock_file(int descriptor, int operation) noexcept __asm__("flock");
int lock_file(int descriptor, int operation) noexcept {
  if (wanted("no_locks")) return 0;
  return next<int (*)(int, int)>("flock")(descriptor, operation);
}

int renameat2(int from_folder, const char* from, int to_folder, const char* to,
              unsigned flags) noexcept {
  if (flags != 0 && wanted("no_flags")) return failing(EINVAL);
  note(std::string("rename ") + from + " " + to);
  return next<int (*)(int, const char*, int, const char*, unsigned)>("renameat2")(
      from_folder, from, to_folder, to, flags);
}

int rename(const char* from, const char* to) noexcept {
  note(std::string("rename ") + from + " " + to);
  return next<int (*)(const char*, const char*)>("rename")(from, to);
}

int unlink(const char* path) noexcept {
  note(std::string("remove ") + path);
  return next<int (*)(const char*)>("unlink")(path);
}

int remove(const char* path) noexcept {
  note(std::string("remove ") + path);
  return next<int (*)(const char*)>("remove")(path);
}

}  // extern "C"
