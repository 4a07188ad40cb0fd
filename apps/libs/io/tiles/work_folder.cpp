#include "io/tiles/work_folder.hpp"

#include <fcntl.h>
#include <sys/file.h>
#include <sys/stat.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <string>
#include <string_view>
#include <system_error>
#include <utility>
#include <vector>

#include "io/tiles/index.hpp"
#include "io/tiles/state.hpp"
#include "vantage/kit/atomic_file.hpp"

namespace vantage::io::tiles {
namespace {

namespace fs = std::filesystem;

constexpr const char* kTilingMarker = ".vantage-tiling";

/// The name of a file that a tiled map or its making has.
bool is_own(std::string_view name) {
  return name == kIndexFile || name == kStateFile || name == kTilingMarker ||
         (name.starts_with("points_") && name.ends_with(".pack")) || is_temporary(name);
}

tl::unexpected<Error> exists(const fs::path& path, std::string message) {
  return fail(ErrorCode::already_exists, std::move(message), SourceLocation{path.string(), 0, 0});
}

bool something_at(const fs::path& path) {
  std::error_code ignored;
  return fs::symlink_status(path, ignored).type() != fs::file_type::not_found;
}

/// Removes a folder that contains only files of a tiled map or its making. What tells so, the index
/// and then the marker, goes last. Errors: `io_failure`.
Result<void> remove_folder(const fs::path& folder) {
  VANTAGE_TRY(std::vector<std::string> names, names_in(folder));
  const auto rank = [](const std::string& name) {
    return name == kTilingMarker ? 2 : name == kIndexFile ? 1 : 0;
  };
  std::sort(names.begin(), names.end(),
            [&](const std::string& a, const std::string& b) { return rank(a) < rank(b); });
  std::error_code error;
  for (const std::string& name : names) {
    if (is_own(name)) fs::remove(folder / name, error);
    if (error) return system_error(folder / name, "the file cannot be removed", error.value());
  }
  fs::remove(folder, error);
  if (error) return system_error(folder, "the folder cannot be removed", error.value());
  return {};
}

/// Errors: `already_exists` for a folder that is not what an interrupted run leaves.
Result<void> check_taken_up(const fs::path& path) {
  const auto keep = [&](const std::string& reason) {
    return exists(path,
                  "a tiled map is made here first, but this is not what an interrupted run "
                  "leaves (" +
                      reason + "); remove it or choose another --out");
  };
  std::error_code error;
  if (fs::symlink_status(path, error).type() != fs::file_type::directory) {
    return keep("it is not a folder");
  }
  VANTAGE_TRY(const auto names, names_in(path));
  for (const std::string& name : names) {
    if (!is_own(name)) return keep("it holds '" + name + "'");
  }
  return {};
}

}  // namespace

Result<void> check_target(const fs::path& out, bool overwrite) {
  if (!something_at(out)) return {};
  if (!overwrite) return exists(out, "already exists (--overwrite replaces a tiled map)");
  const auto keep = [&](const std::string& reason) {
    return exists(
        out, "this is not a tiled map that could be replaced (" + reason + "); it is left alone");
  };
  std::error_code error;
  if (fs::symlink_status(out, error).type() != fs::file_type::directory) {
    return keep("it is not a folder");
  }
  VANTAGE_TRY(const auto names, names_in(out));
  for (const std::string& name : names) {
    if (!is_own(name)) return keep("it holds '" + name + "'");
  }
  if (!names.empty() && !is_tiled_map(out)) return keep(std::string("no ") + kIndexFile);
  return {};
}

Result<WorkFolder> WorkFolder::open(const fs::path& out) {
  fs::path path = out;
  path += ".partial";
  const bool is_new = !something_at(path);
  if (!is_new) VANTAGE_CHECK(check_taken_up(path));
  if (is_new && ::mkdir(path.c_str(), 0777) != 0) {
    const int reason = errno;
    return fail(
        reason == ENOENT || reason == ENOTDIR ? ErrorCode::not_found : ErrorCode::io_failure,
        "cannot be written: the folder " + path.string() + " cannot be created (" +
            system_message(reason) + ")",
        SourceLocation{out.string(), 0, 0});
  }
  Descriptor lock = Descriptor::of(path / kTilingMarker, O_RDWR | O_CREAT);
  if (!lock.open()) return system_error(path / kTilingMarker, "the file cannot be opened", errno);
  if (::flock(lock.get(), LOCK_EX | LOCK_NB) != 0) {
    if (errno == EWOULDBLOCK) return exists(path, "another program tiles a map here right now");
    return system_error(path / kTilingMarker, "the file cannot be locked", errno);
  }
  VANTAGE_TRY(const auto names, names_in(path));
  for (const std::string& name : names) {  // of a run that was killed while it wrote
    std::error_code error;
    if (is_temporary(name)) fs::remove(path / name, error);
    if (error) return system_error(path / name, "the file cannot be removed", error.value());
  }
  WorkFolder folder;
  folder.out_ = out;
  folder.path_ = std::move(path);
  folder.lock_ = std::move(lock);
  return folder;
}

WorkFolder::WorkFolder(WorkFolder&& other) noexcept
    : out_(std::move(other.out_)),
      path_(std::exchange(other.path_, {})),
      lock_(std::move(other.lock_)) {}

WorkFolder::~WorkFolder() {
  try {
    if (!path_.empty() && !something_at(path_ / kStateFile)) (void)remove_folder(path_);
  } catch (...) {  // nothing more can be done in a destructor
  }
}

Result<void> WorkFolder::clear() const {
  VANTAGE_TRY(const auto names, names_in(path_));
  std::error_code error;
  for (const std::string& name : names) {
    if (name != kTilingMarker) fs::remove(path_ / name, error);
    if (error) return system_error(path_ / name, "the file cannot be removed", error.value());
  }
  return {};
}

Result<void> WorkFolder::publish(bool overwrite) {
  VANTAGE_CHECK(flush_folder(path_));
  VANTAGE_CHECK(check_target(out_, overwrite));
  const bool replaces = something_at(out_);
  if (replaces) {
    VANTAGE_CHECK(exchange(path_, out_));
  } else {
    VANTAGE_CHECK(rename_to_new(path_, out_));
  }
  // The map is in place. It is not an error if what is left over cannot be removed.
  const fs::path old = std::exchange(path_, {});
  std::error_code ignored;
  fs::remove(out_ / kStateFile, ignored);
  fs::remove(out_ / kTilingMarker, ignored);
  if (replaces) (void)remove_folder(old);
  return flush_name(out_);
}

}  // namespace vantage::io::tiles
