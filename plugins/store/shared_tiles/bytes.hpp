#pragma once

#include <bit>
#include <cstdint>
#include <cstring>
#include <string>
#include <string_view>
#include <type_traits>

#include "vantage/kit/checksum.hpp"

/// Numbers in files: little endian, and LEB128 (seven bits a byte, the lowest first; the highest
/// bit says that more follow).
namespace vantage::shared_tiles {

static_assert(std::endian::native == std::endian::little, "the files are little endian");

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

/// The checksum of whole words; of what is left over, none. @param sum  of the data before
[[nodiscard]] inline Fnv1a sum_of(std::string_view data, Fnv1a sum = {}) noexcept {
  sum.add_words(data);
  return sum;
}

/// Takes numbers from the front of bytes. After one that is not there, it is not `ok` any more, and
/// everything is 0 or empty.
class ByteReader {
 public:
  explicit ByteReader(std::string_view bytes) noexcept : bytes_(bytes) {}

  [[nodiscard]] bool ok() const noexcept { return ok_; }
  [[nodiscard]] std::size_t left() const noexcept { return bytes_.size(); }

  [[nodiscard]] std::string_view take(std::uint64_t size) noexcept {
    if (size > bytes_.size()) {
      ok_ = false;
      bytes_ = {};
      return {};
    }
    const std::string_view taken = bytes_.substr(0, size);
    bytes_.remove_prefix(size);
    return taken;
  }
  template <class T>
  [[nodiscard]] T number() noexcept {
    T value{};
    const std::string_view bytes = take(sizeof value);
    if (!bytes.empty()) std::memcpy(&value, bytes.data(), sizeof value);
    return value;
  }
  [[nodiscard]] std::uint64_t leb() noexcept {
    std::uint64_t value = 0;
    for (unsigned shift = 0; shift < 64; shift += 7) {
      if (bytes_.empty()) break;
      const auto byte = static_cast<unsigned char>(bytes_.front());
      bytes_.remove_prefix(1);
      value |= static_cast<std::uint64_t>(byte & 127U) << shift;
      if (byte < 128) return value;
    }
    ok_ = false;
    bytes_ = {};
    return 0;
  }

 private:
  std::string_view bytes_;
  bool ok_ = true;
};

}  // namespace vantage::shared_tiles
