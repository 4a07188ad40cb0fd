#pragma once

#include <filesystem>

namespace vantage::conformance {

/// A new, empty folder that is removed with all its content.
class TemporaryFolder {
 public:
  /// If the folder cannot be made, the clause fails and ends.
  TemporaryFolder();
  ~TemporaryFolder();
  TemporaryFolder(const TemporaryFolder&) = delete;
  TemporaryFolder& operator=(const TemporaryFolder&) = delete;
  [[nodiscard]] const std::filesystem::path& path() const noexcept { return path_; }

 private:
  std::filesystem::path path_;
};

}  // namespace vantage::conformance
