#pragma once

#include <filesystem>
#include <functional>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "vantage/kit/file_system.hpp"
#include "vantage/result.hpp"

namespace vantage::io {

/// What the folders of one kind hold. Nothing else is ever replaced or removed.
///
/// A name is that of a file or folder, relative to the folder, with '/' between its parts.
struct FolderKind {
  std::string what;       ///< for errors: "a tiled map"
  std::string overwrite;  ///< for errors, what a user sets to replace one: "--overwrite"

  /// Whether a folder with these names is a finished one. Errors: why it is not.
  std::function<Result<void>(const std::filesystem::path& folder, std::span<const std::string>)>
      check;
  /// Whether an unfinished one may hold this.
  std::function<bool(std::string_view name)> may_hold = [](std::string_view) { return true; };
  /// A file that records progress. An unfinished folder with this file stays, and the next run
  /// continues it. Empty: every run begins anew.
  std::string progress = {};
};

/// A folder that appears under its name only when it is complete. It is made beside that name, in
/// `<name>.partial`, by one process at a time, and commit() renames it. Without a commit, nothing
/// is left behind, except what a later run can continue. What a killed run has left, the next one
/// clears: the file `.vantage-partial` marks an unfinished folder, and is locked.
class OutputFolder {
 public:
  enum class Existing : bool { refuse, replace };
  /// @param overwrite  whether the user asked to replace an existing folder
  [[nodiscard]] static constexpr Existing existing(bool overwrite) noexcept {
    return overwrite ? Existing::replace : Existing::refuse;
  }

  /// Whether a folder may get this name. Errors: those of create(), but for what is in
  /// `<name>.partial`.
  [[nodiscard]] static Result<void> check(const FolderKind& kind, const std::filesystem::path& path,
                                          Existing existing);

  /// Makes the folders above it, too; without a commit they are removed again.
  /// @param path  behind a symbolic link, the folder is replaced, not the link
  /// Errors: `invalid_input` for a path that names no folder; `already_exists` if there is
  /// something of that name that must not be replaced, if `<name>.partial` is not what an
  /// interrupted run leaves, and if another process works there; `io_failure`, also where files
  /// cannot be locked.
  [[nodiscard]] static Result<OutputFolder> create(FolderKind kind,
                                                   const std::filesystem::path& path,
                                                   Existing existing);

  OutputFolder(OutputFolder&& other) noexcept;
  OutputFolder& operator=(OutputFolder&&) = delete;
  ~OutputFolder();

  /// Files go here until the commit.
  [[nodiscard]] const std::filesystem::path& path() const noexcept { return path_; }
  /// Removes what an interrupted run has left. Errors: `io_failure`.
  [[nodiscard]] Result<void> clear() const;

  /// Writes everything to the disk and puts the folder in place; call once, at the end. Errors:
  /// `already_exists`, as for create(); `io_failure`.
  [[nodiscard]] Result<void> commit();

 private:
  OutputFolder() = default;
  [[nodiscard]] Result<void> make_parents(const std::filesystem::path& folder);

  FolderKind kind_;
  Existing existing_ = Existing::refuse;
  std::filesystem::path target_, path_;         // path_ is empty when there is nothing to remove
  std::vector<std::filesystem::path> parents_;  // made here, outermost first
  Descriptor lock_;
};

/// `already_exists`, for FolderKind::check: the folder holds something else.
[[nodiscard]] tl::unexpected<Error> it_holds(std::string_view name);

}  // namespace vantage::io
