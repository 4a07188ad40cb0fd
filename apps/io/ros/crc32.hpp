#pragma once

#include <array>
#include <bit>
#include <cstdint>
#include <cstring>
#include <string_view>

namespace vantage::io::ros {

/// The checksum of zlib, PNG and MCAP (polynomial 0xEDB88320, reflected), eight bytes at a time.
/// @param before  that of the bytes before these; 0 for none
[[nodiscard]] inline std::uint32_t crc32(std::string_view bytes,
                                         std::uint32_t before = 0) noexcept {
  static_assert(std::endian::native == std::endian::little, "words are read in place");
  // Row k: what a byte does to the checksum with k bytes after it.
  static constexpr auto kTables = [] {
    std::array<std::array<std::uint32_t, 256>, 8> tables{};
    for (std::uint32_t i = 0; i < 256; ++i) {
      std::uint32_t value = i;
      for (int bit = 0; bit < 8; ++bit) value = (value >> 1) ^ ((value & 1) * 0xEDB88320U);
      tables[0][i] = value;
    }
    for (std::size_t k = 1; k < 8; ++k) {
      for (std::size_t i = 0; i < 256; ++i) {
        tables[k][i] = (tables[k - 1][i] >> 8) ^ tables[0][tables[k - 1][i] & 0xFF];
      }
    }
    return tables;
  }();
  std::uint32_t sum = ~before;
  while (bytes.size() >= 8) {
    std::uint64_t word = 0;
    std::memcpy(&word, bytes.data(), sizeof(word));
    word ^= sum;
    sum = 0;
    for (std::size_t k = 0; k < 8; ++k) sum ^= kTables[7 - k][(word >> (8 * k)) & 0xFF];
    bytes.remove_prefix(8);
  }
  for (const char c : bytes) {
    sum = (sum >> 8) ^ kTables[0][(sum ^ static_cast<std::uint8_t>(c)) & 0xFF];
  }
  return ~sum;
}

}  // namespace vantage::io::ros
