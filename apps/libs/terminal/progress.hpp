#pragma once

#include <chrono>
#include <cstddef>
#include <string>
#include <string_view>

namespace vantage::cli {

/// "label: 300/1000  30 %  1:05, 2:32 left": what is done, the time taken, and the time left if the
/// rest takes as long per item. The time left is missing if nothing is done yet, or everything is.
/// @param elapsed  [s]
/// If the total is unknown, it is 0: "label: 300  1:05".
[[nodiscard]] std::string progress_line(std::string_view label, std::size_t done, std::size_t total,
                                        double elapsed);
/// The same for a terminal: "label [####......] 300/1000  30 %  1:05, 2:32 left"; without a bar if
/// the total is unknown.
[[nodiscard]] std::string progress_bar(std::string_view label, std::size_t done, std::size_t total,
                                       double elapsed);

/// Says when a line is due on an output where lines stay: at every tenth, and every five minutes in
/// between; if the total is unknown (0), at every thousand and every five minutes.
class ProgressLines {
 public:
  /// @param elapsed  [s] since the start
  [[nodiscard]] bool due(std::size_t done, std::size_t total, double elapsed) noexcept;

 private:
  std::size_t steps_ = 0;
  double last_ = 0.0;  // [s]
};

/// Progress on stderr: a bar on a terminal, cut to the terminal's width; a few plain lines
/// elsewhere. The clock starts when the object is made.
class Progress {
 public:
  /// @param label  what is counted: "localizing (scans)"
  Progress(std::string label, bool quiet);
  ~Progress();  // ends the bar's line
  Progress(const Progress&) = delete;
  Progress& operator=(const Progress&) = delete;

  void update(std::size_t done, std::size_t total);

 private:
  using Clock = std::chrono::steady_clock;
  std::string label_;
  bool quiet_, terminal_;
  std::size_t columns_;
  bool drawn_ = false;
  Clock::time_point start_, last_draw_;
  ProgressLines lines_;
};

}  // namespace vantage::cli
