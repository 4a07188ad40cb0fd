#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <cstring>

/// Byte offsets in a LAS file, little endian: ASPRS LAS Specification 1.4 R15, Sec. 2.
namespace vantage::io::las {

// The public header block; offsets are the same in all versions (Table 3).
inline constexpr std::size_t kGlobalEncoding = 6;    // uint16
inline constexpr std::size_t kMajorVersion = 24;     // uint8
inline constexpr std::size_t kMinorVersion = 25;     // uint8
inline constexpr std::size_t kSystem = 26;           // char[32]
inline constexpr std::size_t kSoftware = 58;         // char[32]
inline constexpr std::size_t kHeaderSize = 94;       // uint16
inline constexpr std::size_t kPointsOffset = 96;     // uint32
inline constexpr std::size_t kVlrCount = 100;        // uint32
inline constexpr std::size_t kFormat = 104;          // uint8
inline constexpr std::size_t kPointSize = 105;       // uint16
inline constexpr std::size_t kLegacyPoints = 107;    // uint32
inline constexpr std::size_t kScale = 131;           // double[3]
inline constexpr std::size_t kOffset = 155;          // double[3]
inline constexpr std::size_t kBounds = 179;          // double[6]: max x, min x, max y, ...
inline constexpr std::size_t kPoints = 247;          // uint64, from 1.4 on
inline constexpr std::size_t kPointsByReturn = 255;  // uint64[15], from 1.4 on

inline constexpr std::size_t kSmallestHeader = 227;
inline constexpr std::size_t kLargestHeader = 375;

[[nodiscard]] constexpr std::size_t header_size(unsigned minor_version) noexcept {
  return minor_version < 3 ? kSmallestHeader : minor_version == 3 ? 235 : kLargestHeader;
}

/// Sizes of point formats 0, 1, ... without extra bytes (Sec. 2.6).
inline constexpr std::array<std::size_t, 11> kPointSizes{20, 28, 26, 34, 57, 63,
                                                         30, 36, 38, 59, 67};
/// LASzip sets these bits in the byte of the point format.
inline constexpr unsigned kCompressionBits = 0xc0;

// The header of a variable length record (Table 6).
inline constexpr std::size_t kVlrHeaderSize = 54;
inline constexpr std::size_t kVlrUser = 2;  // char[16]
inline constexpr std::size_t kVlrUserSize = 16;
inline constexpr std::size_t kVlrRecordId = 18;     // uint16
inline constexpr std::size_t kVlrLength = 20;       // uint16, of the content after the header
inline constexpr std::size_t kVlrDescription = 22;  // char[32]

template <class Stored>
[[nodiscard]] Stored value(const char* bytes) noexcept {
  Stored stored;
  std::memcpy(&stored, bytes, sizeof(stored));
  return stored;
}

template <class Stored>
void put(char* bytes, Stored stored) noexcept {
  std::memcpy(bytes, &stored, sizeof(stored));
}

}  // namespace vantage::io::las
