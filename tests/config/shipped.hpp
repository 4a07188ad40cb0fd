#pragma once

#include <algorithm>
#include <filesystem>
#include <vector>

namespace vantage::test {

/// Every .toml under configs/, in the order of its path.
[[nodiscard]] inline std::vector<std::filesystem::path> shipped_configs() {
  std::vector<std::filesystem::path> files;
  for (const auto& entry :
       std::filesystem::recursive_directory_iterator(VANTAGE_SOURCE_DIR "/configs")) {
    if (entry.path().extension() == ".toml") files.push_back(entry.path());
  }
  std::sort(files.begin(), files.end());
  return files;
}

}  // namespace vantage::test
