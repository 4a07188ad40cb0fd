#include "vantage/kit/json_text.hpp"

#include <algorithm>
#include <cstdint>

namespace vantage {

std::size_t json_depth(std::string_view text) noexcept {
  std::size_t open = 0, deepest = 0;
  bool in_string = false;
  for (std::size_t i = 0; i < text.size(); ++i) {
    const char c = text[i];
    if (in_string) {
      if (c == '\\') ++i;
      in_string = c != '"';
    } else if (c == '[' || c == '{') {
      deepest = std::max(deepest, ++open);
    } else if ((c == ']' || c == '}') && open > 0) {
      --open;
    } else {
      in_string = c == '"';
    }
  }
  return deepest;
}

SourceLocation place_in_text(std::string_view text, std::size_t byte, const std::string& file) {
  const std::string_view before = text.substr(0, std::min(byte == 0 ? 0 : byte - 1, text.size()));
  const auto line = std::count(before.begin(), before.end(), '\n') + 1;
  const std::size_t last_line = before.rfind('\n');
  const std::size_t column =
      before.size() - (last_line == std::string_view::npos ? 0 : last_line + 1) + 1;
  return {file, static_cast<std::uint32_t>(line), static_cast<std::uint32_t>(column)};
}

}  // namespace vantage
