#pragma once

#include <cstddef>
#include <optional>
#include <string>
#include <string_view>

namespace vantage::cli {

/// Formats text for one stream: coloured if a person looks at it, and as wide as the terminal.
/// By default plain and of any width.
class Style {
 public:
  Style() = default;
  Style(bool colored, std::size_t columns) : colored_(colored), columns_(columns) {}
  /// For a stream that is open as a file descriptor.
  /// @param color  "always" or "never"; otherwise `wants_color` decides
  [[nodiscard]] static Style of(int descriptor, std::string_view color);

  [[nodiscard]] std::string good(std::string_view text) const { return in("1;32", text); }
  [[nodiscard]] std::string bad(std::string_view text) const { return in("1;31", text); }
  [[nodiscard]] std::string bold(std::string_view text) const { return in("1", text); }
  [[nodiscard]] std::string dim(std::string_view text) const { return in("2", text); }

  [[nodiscard]] bool colored() const noexcept { return colored_; }
  /// The width of the terminal; 0 if lines may have any length.
  [[nodiscard]] std::size_t columns() const noexcept { return columns_; }

 private:
  /// The text between a code of ECMA-48 and the code that ends it; empty text stays empty.
  [[nodiscard]] std::string in(std::string_view code, std::string_view text) const;

  bool colored_ = false;
  std::size_t columns_ = 0;
};

/// Whether to colour if the user does not say: on a terminal that is not "dumb", unless $NO_COLOR
/// is set to something (no-color.org).
/// @param term, no_color  from the environment; none if unset
[[nodiscard]] bool wants_color(bool terminal, std::optional<std::string_view> term,
                               std::optional<std::string_view> no_color) noexcept;

/// Whether printed lines can be overwritten: on a terminal that is not "dumb".
[[nodiscard]] bool can_redraw(int descriptor);

/// The number of columns that a text takes: colour codes take none, and a character of UTF-8 takes
/// one.
[[nodiscard]] std::size_t display_width(std::string_view text) noexcept;

}  // namespace vantage::cli
