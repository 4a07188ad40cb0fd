#pragma once

#include <concepts>
#include <cstdint>
#include <cstring>
#include <string_view>

namespace vantage {

/// FNV-1a, 64 bit (Fowler, Noll and Vo). Every step is a bijection of the state and of what is
/// added, so a single wrong byte or word always changes the value.
class Fnv1a {
 public:
  /// Adds a byte, or a word of up to 64 bits as one step.
  constexpr void add(std::uint64_t word) noexcept { value_ = (value_ ^ word) * 0x100000001b3ULL; }
  /// Adds bytes, one step each.
  constexpr void add(std::string_view bytes) noexcept {
    for (const char c : bytes) add(static_cast<unsigned char>(c));
  }
  /// Adds the whole words of bytes, one step each: faster than byte by byte.
  /// @return  the bytes that are left over
  template <std::unsigned_integral Word = std::uint64_t>
  std::string_view add_words(std::string_view bytes) noexcept {
    for (; bytes.size() >= sizeof(Word); bytes.remove_prefix(sizeof(Word))) {
      Word word = 0;
      std::memcpy(&word, bytes.data(), sizeof word);
      add(std::uint64_t{word});
    }
    return bytes;
  }
  [[nodiscard]] constexpr std::uint64_t value() const noexcept { return value_; }

 private:
  std::uint64_t value_ = 0xcbf29ce484222325ULL;
};

}  // namespace vantage
