#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <string_view>

namespace vantage::io::ros {

/// The CRC-32 of IEEE 802.3 (reflected polynomial 0xEDB88320), which MCAP uses (MCAP specification,
/// "Records"), over bytes that come in parts.
class Crc32 {
 public:
  void add(std::string_view bytes) noexcept {
    for (const char byte : bytes) {
      state_ = kTable[(state_ ^ static_cast<unsigned char>(byte)) & 0xFFU] ^ (state_ >> 8U);
    }
  }
  /// Of all bytes so far.
  [[nodiscard]] std::uint32_t value() const noexcept { return ~state_; }

 private:
  static constexpr std::array<std::uint32_t, 256> kTable = [] {
    std::array<std::uint32_t, 256> table{};
    for (std::uint32_t i = 0; i < table.size(); ++i) {
      std::uint32_t rest = i;
      for (int bit = 0; bit < 8; ++bit) rest = (rest >> 1U) ^ ((rest & 1U) != 0 ? 0xEDB88320U : 0U);
      table[i] = rest;
    }
    return table;
  }();
  std::uint32_t state_ = 0xFFFFFFFFU;
};

[[nodiscard]] inline std::uint32_t crc32_of(std::string_view bytes) noexcept {
  Crc32 crc;
  crc.add(bytes);
  return crc.value();
}

}  // namespace vantage::io::ros
