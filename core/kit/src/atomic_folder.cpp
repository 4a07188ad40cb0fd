#include "vantage/kit/atomic_folder.hpp"

#include <fcntl.h>
#include <sys/stat.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <iterator>
#include <system_error>
#include <utility>

#include "vantage/kit/atomic_file.hpp"

namespace vantage::io {
namespace {

namespace fs = std::filesystem;
using Names = std::vector<std::string>;

// Says that a folder is unfinished, and is locked by the process that works there.
constexpr const char* kMarker = ".vantage-partial";

tl::unexpected<Error> exists(const fs::path& path, std::string message) {
  return fail(ErrorCode::already_exists, std::move(message), SourceLocation{path.string(), 0, 0});
}

/// What cannot be looked at may be there.
bool may_be_there(const fs::path& path) {
  std::error_code ignored;
  return fs::symlink_status(path, ignored).type() != fs::file_type::not_found;
}

/// A name that says nothing about the kind of a folder.
bool is_of_any_kind(std::string_view name) {
  return name == kMarker || is_temporary(name.substr(name.rfind('/') + 1));
}

/// All names in a folder, and in the folders there. A folder comes after what it holds.
Result<Names> names_below(const fs::path& folder) {
  std::error_code error;
  const auto type = fs::symlink_status(folder, error).type();
  if (error) return system_error(folder, "cannot be looked at", error.value());
  if (type != fs::file_type::directory) {
    return fail(ErrorCode::already_exists, "it is not a folder");
  }
  const std::size_t above = (folder / "").native().size();
  Names names;
  for (fs::recursive_directory_iterator it(folder, error), end; !error && it != end;
       it.increment(error)) {
    names.push_back(it->path().native().substr(above));
  }
  if (error) return system_error(folder, "the folder cannot be listed", error.value());
  std::ranges::sort(names, std::ranges::greater());
  return names;
}

/// All names in a finished folder. Errors: why it is not one.
Result<Names> names_of_finished(const FolderKind& kind, const fs::path& folder) {
  VANTAGE_TRY(Names names, names_below(folder));
  Names telling;
  std::ranges::remove_copy_if(names, std::back_inserter(telling), is_of_any_kind);
  VANTAGE_CHECK(kind.check(folder, telling));
  return names;
}

std::string reason_of(const Error& error) { return error.where ? to_string(error) : error.message; }

/// All names in the folder that the new one replaces; nothing if there is no such folder. Errors:
/// `already_exists` for what must not be replaced.
Result<std::optional<Names>> replaceable(const FolderKind& kind, const fs::path& target,
                                         OutputFolder::Existing existing) {
  if (!may_be_there(target)) return std::nullopt;
  auto names = names_of_finished(kind, target);
  if (!names) {
    return exists(target, "this is not " + kind.what + " that could be replaced (" +
                              reason_of(names.error()) + "); it is left alone");
  }
  if (existing == OutputFolder::Existing::refuse) {
    return exists(target, "exists already; " + kind.overwrite + " replaces it");
  }
  return *std::move(names);
}

/// Errors: why a folder is not what an interrupted run leaves.
Result<void> check_unfinished(const FolderKind& kind, const fs::path& folder) {
  VANTAGE_TRY(const Names names, names_below(folder));
  for (const std::string& name : names) {
    if (!is_of_any_kind(name) && !kind.may_hold(name)) return it_holds(name);
  }
  // Without a mark, a folder may only be one that is empty, because its run was killed before.
  if (names.empty() || std::ranges::count(names, kMarker) > 0) return {};
  return fail(ErrorCode::already_exists, std::string("it has no ") + kMarker);
}

/// Marks a folder that no other process works in. The lock ends with the descriptor.
Result<Descriptor> locked(const fs::path& folder, const std::string& what) {
  const fs::path marker = folder / kMarker;
  Descriptor file = Descriptor::of(marker, O_RDWR | O_CREAT);
  if (!file.open()) return system_error(marker, "the file cannot be opened", errno);
  const int reason = lock_file(file, Wait::no);
  if (reason != 0 && reason != EWOULDBLOCK) {
    ::unlink(marker.c_str());
    return system_error(marker, "the file cannot be locked", reason);
  }
  // The process that held the lock may have moved the folder after this one opened the file.
  struct stat mine {};
  struct stat now {};
  if (reason == 0 && ::fstat(file.get(), &mine) == 0 && ::stat(marker.c_str(), &now) == 0 &&
      mine.st_ino == now.st_ino && mine.st_dev == now.st_dev) {
    return file;
  }
  return exists(folder, "another program is writing " + what + " here right now");
}

/// Removes what is named, as far as that is possible, and the folder if nothing else is in it. The
/// marker goes last: the next run takes up a removal that is cut off.
/// @param lock  of the folder
void remove_folder(const fs::path& folder, const Names& names, Descriptor lock) {
  std::error_code ignored;
  for (const std::string& name : names) {
    if (name != kMarker) fs::remove(folder / name, ignored);
  }
  const auto left = names_below(folder);
  if (!left || *left != Names{kMarker}) return;
  fs::remove(folder / kMarker, ignored);
  lock.close();  // before the folder goes: a network file system keeps the file while it is open
  fs::remove(folder, ignored);
}

enum class Clear : bool { temporary_files, all };

/// Removes what is in a folder, but for the marker. Errors: `io_failure`.
Result<void> clear_folder(const fs::path& folder, Clear what) {
  VANTAGE_TRY(const Names names, names_below(folder));
  std::error_code error;
  for (const std::string& name : names) {
    if (name == kMarker || (what == Clear::temporary_files && !is_of_any_kind(name))) continue;
    fs::remove(folder / name, error);
    if (error) return system_error(folder / name, "cannot be removed", error.value());
  }
  return {};
}

Result<fs::path> resolved(const fs::path& path) {
  const fs::path named = path.has_filename() ? path : path.parent_path();  // "out/" is "out"
  const fs::path name = named.filename();
  if (name.empty() || name == "." || name == "..") {
    return fail(ErrorCode::invalid_input, "'" + path.string() + "' does not name a folder to make");
  }
  std::error_code error;
  fs::path target = fs::weakly_canonical(named, error);
  if (error) return system_error(path, "the path cannot be resolved", error.value());
  return target;
}

}  // namespace

tl::unexpected<Error> it_holds(std::string_view name) {
  return fail(ErrorCode::already_exists, "it holds '" + std::string(name) + "'");
}

Result<void> OutputFolder::check(const FolderKind& kind, const fs::path& path, Existing existing) {
  VANTAGE_TRY(const fs::path target, resolved(path));
  VANTAGE_CHECK(replaceable(kind, target, existing));
  return {};
}

Result<OutputFolder> OutputFolder::create(FolderKind kind, const fs::path& path,
                                          Existing existing) {
  OutputFolder folder;
  VANTAGE_TRY(folder.target_, resolved(path));
  VANTAGE_CHECK(replaceable(kind, folder.target_, existing));
  fs::path partial = folder.target_;
  partial += ".partial";
  VANTAGE_CHECK(folder.make_parents(partial.parent_path()));
  if (::mkdir(partial.c_str(), 0777) != 0) {
    if (errno != EEXIST) return system_error(partial, "the folder cannot be created", errno);
    if (const auto unfinished = check_unfinished(kind, partial); !unfinished) {
      return exists(partial, kind.what +
                                 " is made here first, but this is not what an interrupted " +
                                 "run leaves (" + reason_of(unfinished.error()) +
                                 "); remove it or choose another name");
    }
  }
  auto lock = locked(partial, kind.what);
  if (!lock) {
    ::rmdir(partial.c_str());  // if nothing is in it
    return fail(std::move(lock).error());
  }
  folder.lock_ = *std::move(lock);
  folder.path_ = std::move(partial);
  folder.kind_ = std::move(kind);
  folder.existing_ = existing;
  // What a killed run was writing goes even if the rest is continued.
  const Clear what = folder.kind_.progress.empty() ? Clear::all : Clear::temporary_files;
  VANTAGE_CHECK(clear_folder(folder.path_, what));
  return folder;
}

OutputFolder::OutputFolder(OutputFolder&& other) noexcept
    : kind_(std::move(other.kind_)),
      existing_(other.existing_),
      target_(std::move(other.target_)),
      path_(std::exchange(other.path_, {})),
      parents_(std::exchange(other.parents_, {})),
      lock_(std::move(other.lock_)) {}

OutputFolder::~OutputFolder() {
  try {
    if (!path_.empty() && (kind_.progress.empty() || !may_be_there(path_ / kind_.progress))) {
      Names names = names_below(path_).value_or(Names());
      std::erase_if(names, [&](const std::string& name) {
        return !is_of_any_kind(name) && !kind_.may_hold(name);
      });
      remove_folder(path_, names, std::move(lock_));
    }
  } catch (...) {  // nothing more can be done in a destructor
  }
  for (auto parent = parents_.rbegin(); parent != parents_.rend(); ++parent) {
    ::rmdir(parent->c_str());
  }
}

Result<void> OutputFolder::clear() const { return clear_folder(path_, Clear::all); }

Result<void> OutputFolder::commit() {
  VANTAGE_CHECK(flush_folder(path_));
  VANTAGE_TRY(const std::optional<Names> replaced, replaceable(kind_, target_, existing_));
  Descriptor lock_of_old;
  if (replaced) {
    // Marked before it is moved: whatever happens then, the next run knows what to remove.
    VANTAGE_TRY(lock_of_old, locked(target_, kind_.what));
    if (auto exchanged = exchange(path_, target_); !exchanged) {
      ::unlink((target_ / kMarker).c_str());
      return exchanged;
    }
  } else {
    VANTAGE_CHECK(rename_to_new(path_, target_));
  }
  const fs::path old = std::exchange(path_, {});
  parents_.clear();
  std::error_code ignored;
  if (!kind_.progress.empty()) fs::remove(target_ / kind_.progress, ignored);
  fs::remove(target_ / kMarker, ignored);
  // The name has to survive a power cut, as the files do, before the old folder goes.
  VANTAGE_CHECK(flush_name(target_ / kMarker));
  VANTAGE_CHECK(flush_name(target_));
  // It is not an error if something of the old folder cannot be removed.
  if (replaced) remove_folder(old, *replaced, std::move(lock_of_old));
  return {};
}

Result<void> OutputFolder::make_parents(const fs::path& folder) {
  if (folder.empty() || may_be_there(folder)) return {};
  VANTAGE_CHECK(make_parents(folder.parent_path()));
  std::error_code error;
  if (fs::create_directory(folder, error)) parents_.push_back(folder);
  if (error) return system_error(folder, "the folder cannot be created", error.value());
  return {};
}

}  // namespace vantage::io
