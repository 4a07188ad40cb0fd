#include "vantage/kit/numbers.hpp"

#include <algorithm>
#include <charconv>

namespace vantage {

std::string shortest(double x) {
  char text[32];
  return std::string(text, std::to_chars(text, text + sizeof text, x).ptr);
}

std::string zero_padded(std::uint64_t x, std::size_t digits) {
  const std::string text = std::to_string(x);
  return std::string(digits - std::min(digits, text.size()), '0') + text;
}

std::vector<std::string> numbered(const std::string& prefix, std::uint32_t count) {
  if (count == 0) return {};
  const std::size_t digits = std::max<std::size_t>(3, std::to_string(count - 1).size());
  std::vector<std::string> names;
  names.reserve(count);
  for (std::uint32_t k = 0; k < count; ++k) names.push_back(prefix + zero_padded(k, digits));
  return names;
}

}  // namespace vantage
