#pragma once

#include <concepts>
#include <cstddef>
#include <cstdint>
#include <cstring>
#include <string_view>

namespace vantage::io::ros {

/// Takes little-endian values out of bytes, at any alignment. After the first missing value, that
/// value and all later ones are 0 or empty, and ok() is false.
class ByteReader {
 public:
  explicit ByteReader(std::string_view bytes) noexcept : bytes_(bytes) {}

  template <std::unsigned_integral Integer>
  [[nodiscard]] Integer integer() noexcept {
    Integer value = 0;
    const std::string_view raw = bytes(sizeof(Integer));
    if (ok_) std::memcpy(&value, raw.data(), sizeof(Integer));
    return value;
  }
  [[nodiscard]] std::string_view bytes(std::uint64_t count) noexcept {
    if (!ok_ || count > left()) {
      ok_ = false;
      return {};
    }
    const std::string_view taken = bytes_.substr(at_, static_cast<std::size_t>(count));
    at_ += taken.size();
    return taken;
  }
  /// Bytes that follow their number in 32 bits.
  [[nodiscard]] std::string_view text() noexcept { return bytes(integer<std::uint32_t>()); }

  [[nodiscard]] bool ok() const noexcept { return ok_; }
  [[nodiscard]] std::size_t offset() const noexcept { return at_; }
  [[nodiscard]] std::size_t left() const noexcept { return bytes_.size() - at_; }

 private:
  std::string_view bytes_;
  std::size_t at_ = 0;
  bool ok_ = true;
};

}  // namespace vantage::io::ros
