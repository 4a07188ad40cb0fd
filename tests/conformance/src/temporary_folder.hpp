#pragma once

#include <filesystem>

namespace vantage::conformance {

/// A fresh, empty folder that goes with all that is in it.
class TemporaryFolder {
 public:
  /// A folder that cannot be made fails the clause and ends it.
  TemporaryFolder();
  ~TemporaryFolder();
  TemporaryFolder(const TemporaryFolder&) = delete;
  TemporaryFolder& operator=(const TemporaryFolder&) = delete;
  [[nodiscard]] const std::filesystem::path& path() const noexcept { return path_; }

 private:
  std::filesystem::path path_;
};

}  // namespace vantage::conformance
