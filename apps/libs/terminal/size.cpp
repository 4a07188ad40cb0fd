#include "terminal/size.hpp"

#include <fmt/format.h>

#include <charconv>

namespace vantage::cli {

std::optional<std::uint64_t> parse_memory(std::string_view text) {
  constexpr double kMost = 1e15;  // [bytes]
  double number = 0.0;
  const auto [stop, error] = std::from_chars(text.data(), text.data() + text.size(), number);
  if (error != std::errc{}) return std::nullopt;
  std::string_view unit = text.substr(static_cast<std::size_t>(stop - text.data()));
  if (unit.starts_with(' ')) unit.remove_prefix(1);
  if (unit != "MiB" && unit != "GiB") return std::nullopt;
  const double bytes = number * (unit == "MiB" ? 1048576.0 : 1073741824.0);
  if (!(bytes >= 1.0 && bytes <= kMost)) return std::nullopt;
  return static_cast<std::uint64_t>(bytes);
}

std::string not_memory(std::string_view text) {
  return fmt::format("--memory takes a number above 0 with a unit, as 512MiB or 2GiB, not '{}'",
                     text);
}

std::string size_text(std::uint64_t bytes) {
  const auto number = static_cast<double>(bytes);
  return number < 1e9 ? fmt::format("{:.1f} MB", number / 1e6)
                      : fmt::format("{:.2f} GB", number / 1e9);
}

}  // namespace vantage::cli
