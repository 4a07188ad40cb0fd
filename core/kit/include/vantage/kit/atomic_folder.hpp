#pragma once

#include <filesystem>

#include "vantage/result.hpp"

namespace vantage::io {

/// A folder that appears under its name only when it is complete. Its files are written into a
/// temporary folder beside it, and commit() renames that folder. Without a commit, nothing is left
/// behind.
class OutputFolder {
 public:
  enum class Existing : bool { refuse, replace };

  /// @param existing  with `replace`, commit() removes an existing folder of that name and all its
  ///                  content
  /// Errors: `already_exists` if the name belongs to something other than a folder, or to a folder
  /// that must not be replaced; `not_found` if the parent folder does not exist; `io_failure`.
  [[nodiscard]] static Result<OutputFolder> create(const std::filesystem::path& path,
                                                   Existing existing);

  OutputFolder(OutputFolder&& other) noexcept;
  OutputFolder& operator=(OutputFolder&&) = delete;
  ~OutputFolder();

  /// The temporary folder: files go here until the commit.
  [[nodiscard]] const std::filesystem::path& path() const noexcept { return temporary_; }

  /// Puts the folder in place; call once, at the end. Errors: `io_failure`, `already_exists`.
  [[nodiscard]] Result<void> commit();

 private:
  OutputFolder() = default;

  std::filesystem::path path_, temporary_;  // temporary_ is empty when there is nothing to remove
  Existing existing_ = Existing::refuse;
};

}  // namespace vantage::io
