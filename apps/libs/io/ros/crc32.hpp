#pragma once

#include <zlib.h>

#include <cstdint>
#include <string_view>

namespace vantage::io::ros {

/// The checksum of MCAP (CRC-32 of IEEE 802.3, as in zlib and PNG).
/// @param before  the checksum of the preceding bytes; 0 if there are none
[[nodiscard]] inline std::uint32_t crc32(std::string_view bytes,
                                         std::uint32_t before = 0) noexcept {
  const auto* const data = reinterpret_cast<const Bytef*>(bytes.data());
  return static_cast<std::uint32_t>(::crc32_z(before, data, bytes.size()));
}

}  // namespace vantage::io::ros
