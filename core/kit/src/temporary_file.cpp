#include "vantage/kit/temporary_file.hpp"

#include <fcntl.h>
#include <sys/stat.h>
#include <unistd.h>

#include <cerrno>
#include <string>

namespace vantage::io {

Result<TemporaryFile> create_temporary_for(const std::filesystem::path& target) {
  const SourceLocation where{target.string(), 0, 0};
  struct stat status {};
  if (target.filename().empty() ||
      (::stat(target.c_str(), &status) == 0 && !S_ISREG(status.st_mode))) {
    return fail(ErrorCode::io_failure, "cannot be written: it is not a regular file", where);
  }
  const std::filesystem::path folder = target.has_parent_path() ? target.parent_path() : ".";
  TemporaryFile file;
  for (unsigned attempt = 0; !file.descriptor.open(); ++attempt) {
    file.path = folder /
                (".vantage-" + std::to_string(::getpid()) + "-" + std::to_string(attempt) + ".tmp");
    file.descriptor = Descriptor::of(file.path, O_WRONLY | O_CREAT | O_EXCL);
    if (file.descriptor.open() || errno == EEXIST) continue;
    const int reason = errno;
    return fail(
        reason == ENOENT || reason == ENOTDIR ? ErrorCode::not_found : ErrorCode::io_failure,
        "cannot be written: no file can be created in the folder " + folder.string() + " (" +
            system_message(reason) + ")",
        where);
  }
  return file;
}

}  // namespace vantage::io
