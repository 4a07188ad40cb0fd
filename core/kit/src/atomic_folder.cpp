#include "vantage/kit/atomic_folder.hpp"

#include <fcntl.h>
#include <sys/stat.h>
#include <unistd.h>

#include <cerrno>
#include <cstdio>
#include <system_error>
#include <utility>

#include "vantage/kit/file_system.hpp"

namespace vantage::io {
namespace {

namespace fs = std::filesystem;

tl::unexpected<Error> error_at(const fs::path& path, ErrorCode code, std::string message) {
  return fail(code, std::move(message), SourceLocation{path.string(), 0, 0});
}

fs::path folder_above(const fs::path& path) {
  return path.has_parent_path() ? path.parent_path() : ".";
}

}  // namespace

Result<OutputFolder> OutputFolder::create(const fs::path& path, Existing existing) {
  OutputFolder folder;
  folder.path_ = path.has_filename() ? path : path.parent_path();  // "out/" is "out"
  folder.existing_ = existing;
  std::error_code ignored;
  const auto type = fs::symlink_status(folder.path_, ignored).type();
  if (type != fs::file_type::not_found && type != fs::file_type::directory) {
    return error_at(path, ErrorCode::already_exists, "already exists and is not a folder");
  }
  if (type == fs::file_type::directory && existing == Existing::refuse) {
    return error_at(path, ErrorCode::already_exists, "the folder already exists");
  }
  const fs::path above = folder_above(folder.path_);
  for (unsigned attempt = 0;; ++attempt) {
    const fs::path temporary = above / (".vantage-" + std::to_string(::getpid()) + "-" +
                                        std::to_string(attempt) + ".partial");
    if (::mkdir(temporary.c_str(), 0777) == 0) {
      folder.temporary_ = temporary;
      return folder;
    }
    if (errno == EEXIST) continue;
    const int reason = errno;
    return error_at(
        path, reason == ENOENT || reason == ENOTDIR ? ErrorCode::not_found : ErrorCode::io_failure,
        "cannot be written: no folder can be created in " + above.string() + " (" +
            system_message(reason) + ")");
  }
}

OutputFolder::OutputFolder(OutputFolder&& other) noexcept
    : path_(std::move(other.path_)),
      temporary_(std::exchange(other.temporary_, {})),
      existing_(other.existing_) {}

OutputFolder::~OutputFolder() {
  std::error_code ignored;
  if (!temporary_.empty()) fs::remove_all(temporary_, ignored);
}

Result<void> OutputFolder::commit() {
  std::error_code ignored;
  if (existing_ == Existing::replace &&
      fs::symlink_status(path_, ignored).type() != fs::file_type::not_found) {
    // The old folder takes the temporary name and is removed with this object.
    VANTAGE_CHECK(exchange(temporary_, path_));
  } else {
    VANTAGE_CHECK(rename_to_new(temporary_, path_));
    temporary_.clear();
  }
  return flush_name(path_);
}

}  // namespace vantage::io
