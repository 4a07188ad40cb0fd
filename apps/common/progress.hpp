#pragma once

#include <chrono>
#include <cstddef>
#include <string>

namespace vantage::cli {

/// Progress on stderr: a bar with the time to go on a terminal, a plain line every tenth elsewhere.
class Progress {
 public:
  /// @param label  what is being counted: "localizing (scans)"
  Progress(std::string label, bool quiet);
  ~Progress();  // ends the bar's line
  Progress(const Progress&) = delete;
  Progress& operator=(const Progress&) = delete;

  void update(std::size_t done, std::size_t total);

 private:
  using Clock = std::chrono::steady_clock;
  std::string label_;
  bool quiet_, terminal_;
  bool drawn_ = false;
  Clock::time_point start_, last_draw_;
  std::size_t last_tenth_ = 0;
};

}  // namespace vantage::cli
