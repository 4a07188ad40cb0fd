#pragma once

#include <filesystem>

#include "vantage/kit/file_system.hpp"
#include "vantage/result.hpp"

namespace vantage::io::tiles {

/// Whether a tiled map may get this name. Errors: `already_exists`.
[[nodiscard]] Result<void> check_target(const std::filesystem::path& out, bool overwrite);

/// The folder that a tiled map is made in, beside the one that it becomes. One process at a time
/// works in it. It stays if the run does not end well and its state was written; otherwise it goes.
class WorkFolder {
 public:
  /// Makes the folder, or takes up that of an interrupted run.
  /// Errors: `already_exists` if another process works there, or if the folder holds anything else;
  /// `not_found` if the folder above does not exist; `io_failure`.
  [[nodiscard]] static Result<WorkFolder> open(const std::filesystem::path& out);

  WorkFolder(WorkFolder&& other) noexcept;
  WorkFolder& operator=(WorkFolder&&) = delete;
  ~WorkFolder();

  [[nodiscard]] const std::filesystem::path& path() const noexcept { return path_; }
  /// Removes what an interrupted run has left. Errors: `io_failure`.
  [[nodiscard]] Result<void> clear() const;
  /// Gives the folder its name; call once, when all its files are written. Errors: those of
  /// check_target; `io_failure`.
  [[nodiscard]] Result<void> publish(bool overwrite);

 private:
  WorkFolder() = default;

  std::filesystem::path out_, path_;  // path_ is empty when there is nothing to remove
  Descriptor lock_;
};

}  // namespace vantage::io::tiles
