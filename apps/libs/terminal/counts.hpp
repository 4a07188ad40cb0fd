#pragma once

#include <fmt/format.h>

#include <cmath>
#include <cstddef>
#include <cstdint>
#include <string>
#include <string_view>

namespace vantage::cli {

/// 1234567 as "1,234,567": how people read counts. Files and JSON have no commas.
[[nodiscard]] inline std::string grouped(std::uint64_t number) {
  std::string digits = std::to_string(number);
  for (std::size_t i = digits.size(); i > 3; i -= 3) digits.insert(i - 3, ",");
  return digits;
}

/// A number as a whole one: 1234.6 as "1,235". Where nobody counts any more, three digits of it.
[[nodiscard]] inline std::string grouped_whole(double number) {
  constexpr double kCounted = 1e15;
  const double whole = std::round(std::abs(number));
  if (!(whole < kCounted)) return fmt::format("{:.3g}", number);
  return (number < 0.0 && whole > 0.0 ? "-" : "") + grouped(static_cast<std::uint64_t>(whole));
}

/// The form for this number: "region" or "regions".
/// @param many  the plural; `one` with an "s" if left out
[[nodiscard]] inline std::string form(std::uint64_t number, std::string_view one,
                                      std::string_view many = {}) {
  if (number == 1) return std::string(one);
  return many.empty() ? std::string(one) + "s" : std::string(many);
}

/// "1 region", "1,234 regions".
[[nodiscard]] inline std::string counted(std::uint64_t number, std::string_view one,
                                         std::string_view many = {}) {
  return grouped(number) + " " + form(number, one, many);
}

}  // namespace vantage::cli
