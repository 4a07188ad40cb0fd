#pragma once

#include <doctest/doctest.h>

#include <filesystem>
#include <string>

#include "support/process.hpp"

namespace vantage::test {

[[nodiscard]] inline bool has(const std::string& text, const std::string& part) {
  return text.find(part) != std::string::npos;
}

/// Replaces the first `what` of a file; without one the test fails.
inline void replace_in_file(const std::filesystem::path& path, const std::string& what,
                            const std::string& with) {
  std::string text = read_text(path);
  const std::size_t at = text.find(what);
  REQUIRE(at != std::string::npos);
  write_text(path, text.replace(at, what.size(), with));
}

}  // namespace vantage::test
