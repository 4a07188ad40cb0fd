#include "common/progress.hpp"

#include <fmt/format.h>
#include <unistd.h>

#include <algorithm>
#include <cstdio>

namespace vantage::cli {
namespace {

std::string duration(double seconds) {
  const auto whole = static_cast<long>(seconds + 0.5);
  if (whole >= 3600)
    return fmt::format("{}:{:02}:{:02}", whole / 3600, whole / 60 % 60, whole % 60);
  return fmt::format("{}:{:02}", whole / 60, whole % 60);
}

}  // namespace

Progress::Progress(std::string label, bool quiet)
    : label_(std::move(label)),
      quiet_(quiet),
      terminal_(isatty(STDERR_FILENO) == 1),
      start_(Clock::now()) {}

Progress::~Progress() {
  if (drawn_ && terminal_) fmt::print(stderr, "\n");
}

void Progress::update(std::size_t done, std::size_t total) {
  if (quiet_ || total == 0) return;
  const auto now = Clock::now();
  const double elapsed = std::chrono::duration<double>(now - start_).count();
  const double share = static_cast<double>(done) / static_cast<double>(total);
  const std::string left = done == 0 ? "" : "  ETA " + duration(elapsed / share - elapsed);
  if (terminal_) {
    if (drawn_ && done < total && now - last_draw_ < std::chrono::milliseconds(100)) return;
    constexpr std::size_t kWidth = 30;
    const auto filled = std::min(kWidth, static_cast<std::size_t>(share * kWidth));
    fmt::print(stderr, "\r{} [{}{}] {}/{}  {}{}\033[K", label_, std::string(filled, '#'),
               std::string(kWidth - filled, '.'), done, total, duration(elapsed),
               done < total ? left : "");
    std::fflush(stderr);
    drawn_ = true;
    last_draw_ = now;
    return;
  }
  const auto tenth = static_cast<std::size_t>(share * 10.0);
  if (tenth > last_tenth_) {
    fmt::print(stderr, "{}: {}/{}  {}{}\n", label_, done, total, duration(elapsed),
               done < total ? left : "");
    last_tenth_ = tenth;
  }
}

}  // namespace vantage::cli
