#include "terminal/progress.hpp"

#include <fmt/format.h>
#include <unistd.h>

#include <algorithm>
#include <cstdio>

#include "terminal/counts.hpp"
#include "terminal/style.hpp"

namespace vantage::cli {
namespace {

constexpr double kLongestSilence = 300.0;  // [s]

std::string duration(double seconds) {
  const auto whole = static_cast<long long>(seconds + 0.5);
  if (whole >= 3600)
    return fmt::format("{}:{:02}:{:02}", whole / 3600, whole / 60 % 60, whole % 60);
  return fmt::format("{}:{:02}", whole / 60, whole % 60);
}

double share_of(std::size_t done, std::size_t total) {
  if (total == 0) return 0.0;
  return static_cast<double>(done) / static_cast<double>(total);
}

std::string numbers(std::size_t done, std::size_t total, double elapsed) {
  if (total == 0) return fmt::format("{}  {}", grouped(done), duration(elapsed));
  const double share = share_of(done, total);
  std::string text = fmt::format("{}/{}  {} %  {}", grouped(done), grouped(total),
                                 static_cast<int>(100.0 * share), duration(elapsed));
  if (done > 0 && done < total) {
    text += fmt::format(", {} left", duration(elapsed / share - elapsed));
  }
  return text;
}

}  // namespace

std::string progress_line(std::string_view label, std::size_t done, std::size_t total,
                          double elapsed) {
  return fmt::format("{}: {}", label, numbers(done, total, elapsed));
}

std::string progress_bar(std::string_view label, std::size_t done, std::size_t total,
                         double elapsed) {
  if (total == 0) return progress_line(label, done, total, elapsed);
  constexpr std::size_t kWidth = 30;
  const auto filled = static_cast<std::size_t>(share_of(done, total) * kWidth);
  return fmt::format("{} [{}{}] {}", label, std::string(filled, '#'),
                     std::string(kWidth - filled, '.'), numbers(done, total, elapsed));
}

bool ProgressLines::due(std::size_t done, std::size_t total, double elapsed) noexcept {
  const std::size_t steps =
      total == 0 ? done / 1000 : static_cast<std::size_t>(share_of(done, total) * 10.0);
  if (steps == steps_ && elapsed - last_ < kLongestSilence) return false;
  steps_ = steps;
  last_ = elapsed;
  return true;
}

Progress::Progress(std::string label, bool quiet)
    : label_(std::move(label)),
      quiet_(quiet),
      terminal_(can_redraw(STDERR_FILENO)),
      columns_(Style::of(STDERR_FILENO, "never").columns()),
      start_(Clock::now()) {}

Progress::~Progress() {
  if (drawn_ && terminal_) fmt::print(stderr, "\n");
}

void Progress::update(std::size_t done, std::size_t total) {
  if (quiet_) return;
  if (total > 0) total = std::max(total, done);  // the total of a recording may be too small
  const auto now = Clock::now();
  const double elapsed = std::chrono::duration<double>(now - start_).count();
  if (!terminal_) {
    if (lines_.due(done, total, elapsed)) {
      fmt::print(stderr, "{}\n", progress_line(label_, done, total, elapsed));
    }
    return;
  }
  if (drawn_ && done != total && now - last_draw_ < std::chrono::milliseconds(100)) return;
  // A bar wider than the terminal would leave a line behind at every step.
  std::string bar = progress_bar(label_, done, total, elapsed);
  if (columns_ > 0 && bar.size() >= columns_) bar.resize(columns_ - 1);
  fmt::print(stderr, "\r{}\033[K", bar);
  std::fflush(stderr);
  drawn_ = true;
  last_draw_ = now;
}

}  // namespace vantage::cli
