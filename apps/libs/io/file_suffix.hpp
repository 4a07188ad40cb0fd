#pragma once

#include <algorithm>
#include <filesystem>
#include <string>

namespace vantage::io {

/// ".pcd" for "map.PCD".
[[nodiscard]] inline std::string lower_case_suffix(const std::filesystem::path& path) {
  std::string suffix = path.extension().string();
  std::transform(suffix.begin(), suffix.end(), suffix.begin(), [](char c) {
    return c >= 'A' && c <= 'Z' ? static_cast<char>(c - 'A' + 'a') : c;
  });
  return suffix;
}

}  // namespace vantage::io
