#include "terminal/style.hpp"

#include <sys/ioctl.h>
#include <unistd.h>

#include <cstdlib>

namespace vantage::cli {
namespace {

std::optional<std::string_view> variable(const char* name) {
  const char* value = std::getenv(name);
  return value == nullptr ? std::nullopt : std::optional<std::string_view>(value);
}

std::size_t columns_of(int descriptor) {
  winsize size{};
  return ::ioctl(descriptor, TIOCGWINSZ, &size) == 0 ? size.ws_col : 0;
}

}  // namespace

Style Style::of(int descriptor, std::string_view color) {
  const bool terminal = ::isatty(descriptor) == 1;
  const bool colored =
      color == "always" ||
      (color != "never" && wants_color(terminal, variable("TERM"), variable("NO_COLOR")));
  return {colored, terminal ? columns_of(descriptor) : 0};
}

std::string Style::in(std::string_view code, std::string_view text) const {
  if (!colored_ || text.empty()) return std::string(text);
  return "\033[" + std::string(code) + "m" + std::string(text) + "\033[0m";
}

bool wants_color(bool terminal, std::optional<std::string_view> term,
                 std::optional<std::string_view> no_color) noexcept {
  const bool refused = no_color && !no_color->empty();
  return terminal && !refused && term && !term->empty() && *term != "dumb";
}

bool can_redraw(int descriptor) {
  return wants_color(::isatty(descriptor) == 1, variable("TERM"), std::nullopt);
}

std::size_t display_width(std::string_view text) noexcept {
  std::size_t width = 0;
  for (std::size_t i = 0; i < text.size(); ++i) {
    if (text.substr(i).starts_with("\033[")) {
      i = text.find('m', i);
      if (i == std::string_view::npos) break;
    } else if ((static_cast<unsigned char>(text[i]) & 0xC0u) != 0x80u) {
      ++width;
    }
  }
  return width;
}

}  // namespace vantage::cli
