#include "io/text.hpp"

#include <fmt/format.h>

#include <cmath>

namespace vantage::io {

std::optional<std::string_view> LineReader::next() noexcept {
  if (offset_ >= text_.size()) return std::nullopt;
  const std::size_t end = text_.find('\n', offset_);
  std::string_view line =
      text_.substr(offset_, end == std::string_view::npos ? std::string_view::npos : end - offset_);
  offset_ = end == std::string_view::npos ? text_.size() : end + 1;
  ++line_;
  if (!line.empty() && line.back() == '\r') line.remove_suffix(1);
  return line;
}

std::string quoted(std::string_view text) {
  constexpr std::size_t kLongest = 40;
  std::string result = "'";
  for (const char c : text.substr(0, kLongest)) result += c >= ' ' && c <= '~' ? c : '?';
  if (text.size() > kLongest) result += "...";
  return result + '\'';
}

bool is_blank_or_comment(std::string_view line) noexcept {
  const std::string_view word = WordReader(line).next();
  return word.empty() || word.front() == '#';
}

std::optional<std::string> problem_of_stamp(double seconds) {
  constexpr double kLatest = 1e11;
  if (std::abs(seconds) <= kLatest) return std::nullopt;
  return fmt::format("{} is no stamp in seconds, which are below {:g}: are these nanoseconds?",
                     seconds, kLatest);
}

}  // namespace vantage::io
