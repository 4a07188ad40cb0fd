#pragma once

#include <cstdint>
#include <filesystem>
#include <string>
#include <vector>

namespace vantage::test {

struct Finished {
  int exit_code = -1;  ///< 128 + signal for a program that a signal ended
  std::string out, err;
  /// The largest amount of memory that it took, or this process when it started it [bytes].
  std::uint64_t peak_memory = 0;
};

/// Runs one of the built programs (`vantage-build`, ...), or any by its absolute path, to its end,
/// without a shell.
[[nodiscard]] Finished run(const std::string& program, const std::vector<std::string>& arguments);

[[nodiscard]] std::string read_text(const std::filesystem::path& path);
void write_text(const std::filesystem::path& path, const std::string& text);

}  // namespace vantage::test
