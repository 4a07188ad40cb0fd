#pragma once

#include <cstdint>
#include <string>
#include <string_view>
#include <type_traits>

#include "vantage/kit/byte_io.hpp"

/// Numbers in files: little endian, and LEB128 (seven bits a byte, the lowest first; the highest
/// bit says that more follow).
namespace vantage::shared_tiles {

inline constexpr std::size_t kWord = 8;  ///< files are made of words of this size [bytes]

template <class T>
void append(std::string& to, const T& value) {
  static_assert(std::is_trivially_copyable_v<T>);
  to.append(reinterpret_cast<const char*>(&value), sizeof value);
}

inline void append_leb(std::string& to, std::uint64_t value) {
  for (; value >= 128; value >>= 7U) to.push_back(static_cast<char>(value | 128U));
  to.push_back(static_cast<char>(value));
}

/// Fills up with zeros to whole words.
inline void pad(std::string& text) { text.resize((text.size() + kWord - 1) / kWord * kWord, '\0'); }

}  // namespace vantage::shared_tiles
