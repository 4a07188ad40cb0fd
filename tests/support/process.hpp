#pragma once

#include <cstdint>
#include <filesystem>
#include <string>
#include <vector>

#include "support/real_data.hpp"

namespace vantage::test {

struct Finished {
  int exit_code = -1;  ///< 128 + signal for a program that a signal ended
  std::string out, err;
  /// The largest amount of memory that it took, or this process when it started it [bytes].
  std::uint64_t peak_memory = 0;
};

/// A program that runs: one of the built programs (`vantage-build`, ...), or any by its absolute
/// path, without a shell. It is killed if nobody waits for it.
class Running {
 public:
  Running(const std::string& program, const std::vector<std::string>& arguments);
  ~Running();
  Running(const Running&) = delete;
  Running& operator=(const Running&) = delete;

  void signal(int number) const;
  /// What it has written to standard error so far.
  [[nodiscard]] std::string err() const;
  /// Waits until its standard error contains a text. @return whether it does before it ends
  [[nodiscard]] bool says(const std::string& text) const;
  [[nodiscard]] Finished wait();

 private:
  TemporaryFolder folder_;
  int child_ = 0;
};

/// Runs a program to its end.
[[nodiscard]] Finished run(const std::string& program, const std::vector<std::string>& arguments);

[[nodiscard]] std::string read_text(const std::filesystem::path& path);
void write_text(const std::filesystem::path& path, const std::string& text);

}  // namespace vantage::test
