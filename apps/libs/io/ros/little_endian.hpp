#pragma once

#include <algorithm>
#include <array>
#include <bit>
#include <string>
#include <type_traits>

namespace vantage::io::ros {

/// Appends a number, its lowest byte first.
template <class T>
void append_little_endian(std::string& bytes, T number) {
  static_assert(std::is_arithmetic_v<T>);
  auto raw = std::bit_cast<std::array<char, sizeof(T)>>(number);
  if constexpr (std::endian::native == std::endian::big) std::reverse(raw.begin(), raw.end());
  bytes.append(raw.data(), raw.size());
}

}  // namespace vantage::io::ros
