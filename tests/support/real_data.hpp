#pragma once

#include <filesystem>
#include <optional>
#include <string>

namespace vantage::test {

/// A file or folder of the recorded data ($VANTAGE_DATA_DIR, default ../shared/data beside the
/// project), or nothing, in which case a line on stdout says that the test was skipped.
[[nodiscard]] std::optional<std::filesystem::path> real_data(const std::string& relative);

/// A fresh, empty folder for one test; removed when the object goes.
class TemporaryFolder {
 public:
  TemporaryFolder();
  ~TemporaryFolder();
  TemporaryFolder(const TemporaryFolder&) = delete;
  TemporaryFolder& operator=(const TemporaryFolder&) = delete;
  [[nodiscard]] const std::filesystem::path& path() const noexcept { return path_; }

 private:
  std::filesystem::path path_;
};

}  // namespace vantage::test
