#pragma once

#include <charconv>
#include <cstdint>
#include <optional>
#include <string>
#include <string_view>
#include <system_error>

namespace vantage::io {

/// What is wrong with a number of a text as a stamp in seconds; nothing if it may be one. Since
/// 1970, 1e11 s last until the year 5138.
[[nodiscard]] std::optional<std::string> problem_of_stamp(double seconds);

/// Takes a text apart into lines; accepts "\n" and "\r\n".
class LineReader {
 public:
  explicit LineReader(std::string_view text) noexcept : text_(text) {}
  /// A reader that starts at `offset`, after `line` lines.
  LineReader(std::string_view text, std::size_t offset, std::uint32_t line) noexcept
      : text_(text), offset_(offset), line_(line) {}

  /// The next line without its end, or nothing at the end of the text.
  [[nodiscard]] std::optional<std::string_view> next() noexcept;
  /// The number of the line that next() gave last, from 1; 0 before the first.
  [[nodiscard]] std::uint32_t line() const noexcept { return line_; }
  /// The byte after that line's end.
  [[nodiscard]] std::size_t offset() const noexcept { return offset_; }

 private:
  std::string_view text_;
  std::size_t offset_ = 0;
  std::uint32_t line_ = 0;
};

/// Takes a line apart at blanks and tabs.
class WordReader {
 public:
  explicit WordReader(std::string_view line) noexcept : rest_(line) {}
  /// The next word, or an empty view at the end of the line.
  [[nodiscard]] std::string_view next() noexcept {
    const char* at = rest_.data();
    const char* const end = at + rest_.size();
    while (at != end && is_blank(*at)) ++at;
    const char* const start = at;
    while (at != end && !is_blank(*at)) ++at;
    rest_ = {at, static_cast<std::size_t>(end - at)};
    return {start, static_cast<std::size_t>(at - start)};
  }
  /// How many words are left.
  [[nodiscard]] std::size_t count() const noexcept {
    WordReader rest = *this;
    std::size_t words = 0;
    while (!rest.next().empty()) ++words;
    return words;
  }

 private:
  static bool is_blank(char c) noexcept {
    return c == ' ' || c == '\t' || c == '\r' || c == '\v' || c == '\f';
  }
  std::string_view rest_;
};

/// The number that the whole word spells in decimal notation, in any locale. Nothing if it spells
/// no number, or one that `Number` cannot hold. For floating point, "nan" and "inf" are numbers.
template <class Number>
[[nodiscard]] std::optional<Number> parse_number(std::string_view word) noexcept {
  if (word.size() > 1 && word[0] == '+' && word[1] != '-') word.remove_prefix(1);
  Number number{};
  const auto [end, error] = std::from_chars(word.data(), word.data() + word.size(), number);
  if (error != std::errc{} || end != word.data() + word.size()) return std::nullopt;
  return number;
}

/// 'text' for a message: cut after 40 characters, with '?' for unprintable bytes.
[[nodiscard]] std::string quoted(std::string_view text);

/// Whether a line contains nothing but blanks, or starts a comment with '#'.
[[nodiscard]] bool is_blank_or_comment(std::string_view line) noexcept;

}  // namespace vantage::io
