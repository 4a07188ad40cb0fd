#pragma once

#include <filesystem>

#include "vantage/result.hpp"

namespace vantage::io {

/// A folder that appears under its name only when it is complete: its files are written into a
/// temporary folder beside it, which commit() renames. Without a commit nothing is left behind.
class OutputFolder {
 public:
  enum class Existing : bool { refuse, replace };

  /// @param existing  with `replace`, commit() removes a folder of that name with all that is in it
  /// Errors: `already_exists` for something of that name that is not to be replaced or is no
  /// folder; `not_found` if the folder above does not exist; `io_failure`.
  [[nodiscard]] static Result<OutputFolder> create(const std::filesystem::path& path,
                                                   Existing existing);

  OutputFolder(OutputFolder&& other) noexcept;
  OutputFolder& operator=(OutputFolder&&) = delete;
  ~OutputFolder();

  /// Where to write the files until the commit.
  [[nodiscard]] const std::filesystem::path& path() const noexcept { return temporary_; }

  /// Puts the folder in place; call once, at the end. Errors: `io_failure`, `already_exists`.
  [[nodiscard]] Result<void> commit();

 private:
  OutputFolder() = default;

  std::filesystem::path path_, temporary_;  // the latter is empty when there is none to remove
  Existing existing_ = Existing::refuse;
};

}  // namespace vantage::io
