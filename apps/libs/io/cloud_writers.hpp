#pragma once

#include <algorithm>
#include <array>
#include <bit>
#include <cstdint>
#include <cstring>
#include <filesystem>
#include <span>
#include <string>

#include "vantage/io/point_cloud_io.hpp"
#include "vantage/kit/atomic_file.hpp"

namespace vantage::io {

static_assert(std::endian::native == std::endian::little, "binary files are written in place");

/// The checks that every writer of clouds makes first: the precision can hold the coordinates, and
/// there is one view count per point, or none at all. Errors (`where` is `path`): `invalid_input`.
[[nodiscard]] Result<void> check_writable(const std::filesystem::path& path, PointsView points,
                                          Precision precision,
                                          std::span<const std::uint32_t> views);

template <class Stored>
void append(std::string& bytes, Stored value) {
  std::array<char, sizeof(value)> raw;
  std::memcpy(raw.data(), &value, raw.size());
  bytes.append(raw.data(), raw.size());
}

/// Appends x, y and z in the type of that precision.
void append_point(std::string& bytes, const Point& point, Precision precision);

/// @param append_record  void(std::string& bytes, std::size_t i)
template <class AppendRecord>
Result<void> write_records(OutputFile& file, std::size_t count, const AppendRecord& append_record) {
  constexpr std::size_t kRecordsAtOnce = 4096;
  std::string bytes;
  for (std::size_t first = 0; first < count; first += kRecordsAtOnce) {
    bytes.clear();
    const std::size_t end = std::min(count, first + kRecordsAtOnce);
    for (std::size_t i = first; i < end; ++i) append_record(bytes, i);
    VANTAGE_CHECK(file.write(bytes));
  }
  return {};
}

}  // namespace vantage::io
