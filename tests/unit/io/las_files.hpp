#pragma once

#include <algorithm>
#include <array>
#include <cstdint>
#include <string>
#include <vector>

#include "files.hpp"

namespace vantage::test {

/// A LAS file with scales 0.001, 0.001, 0.5 and offsets 500000, 4650000, 100.
struct LasFile {
  struct Vlr {
    std::string user;
    std::uint16_t id = 0;
    std::string content;
  };
  unsigned minor = 2;
  unsigned format = 0;
  unsigned extra_bytes = 0;     // after each point
  unsigned header_padding = 0;  // bytes that belong to the header
  unsigned points_padding = 0;  // bytes between the records and the points
  std::vector<Vlr> vlrs = {};
  std::vector<std::array<std::int32_t, 3>> points = {
      {1, -2, 1}, {4000, 5000, 120}, {2147483647, -2147483647 - 1, 0}};
};

template <class T>
std::string overwrite(std::string bytes, std::size_t at, T value) {
  const std::string with = raw(value);
  REQUIRE(at + with.size() <= bytes.size());
  std::copy(with.begin(), with.end(), bytes.begin() + static_cast<std::ptrdiff_t>(at));
  return bytes;
}

inline std::string las_file(const LasFile& layout) {
  constexpr std::array<std::uint16_t, 11> kSizes{20, 28, 26, 34, 57, 63, 30, 36, 38, 59, 67};
  const std::size_t size = layout.minor < 3 ? 227 : layout.minor == 3 ? 235 : 375;
  std::string records;
  for (const auto& [user, id, content] : layout.vlrs) {
    std::string name = user;
    name.resize(16);
    records += std::string(2, '\0') + name + raw(id) +
               raw(static_cast<std::uint16_t>(content.size())) + std::string(32, 'd') + content;
  }
  const auto point_size = static_cast<std::uint16_t>(kSizes.at(layout.format) + layout.extra_bytes);
  const std::size_t padded = size + layout.header_padding;
  const auto count = static_cast<std::uint32_t>(layout.points.size());
  std::string bytes = "LASF" + std::string(padded - 4, '\0');
  bytes = overwrite(bytes, 24, std::uint8_t{1});
  bytes = overwrite(bytes, 25, static_cast<std::uint8_t>(layout.minor));
  bytes = overwrite(bytes, 94, static_cast<std::uint16_t>(padded));
  bytes = overwrite(bytes, 96,
                    static_cast<std::uint32_t>(padded + records.size() + layout.points_padding));
  bytes = overwrite(bytes, 100, static_cast<std::uint32_t>(layout.vlrs.size()));
  bytes = overwrite(bytes, 104, static_cast<std::uint8_t>(layout.format));
  bytes = overwrite(bytes, 105, point_size);
  bytes = overwrite(bytes, 107, layout.minor < 4 || layout.format < 6 ? count : 0);
  bytes = overwrite(bytes, 131, std::array{0.001, 0.001, 0.5, 500000.0, 4650000.0, 100.0});
  if (layout.minor == 4) bytes = overwrite(bytes, 247, std::uint64_t{count});
  bytes += records + std::string(layout.points_padding, '\xdd');
  for (const auto& point : layout.points) {
    bytes += raw(point);
    bytes.append(point_size - sizeof(point), '\x7f');
  }
  return bytes;
}

}  // namespace vantage::test
