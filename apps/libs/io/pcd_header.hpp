#pragma once

#include <array>
#include <cstdint>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "io/point_fields.hpp"

namespace vantage::io::pcd {

struct Field {
  std::string_view name;
  char type = 0;             // I, U or F
  std::uint64_t size = 0;    // [bytes] of one value
  std::uint64_t count = 1;   // values
  std::uint64_t offset = 0;  // of the first value in a point [bytes]
  std::uint64_t column = 0;  // of the first value in a line
};

enum class Encoding : std::uint8_t { ascii, binary, binary_compressed };

/// What precedes the points of a PCD file; its names are views of the content.
struct Header {
  std::vector<Field> fields;
  std::array<Field, 3> axes;  // x, y, z
  std::optional<Field> time;
  TimeFormat time_format;
  std::uint64_t point_size = 0;  // [bytes]
  std::uint64_t columns = 0;     // values a point
  std::uint64_t points = 0;
  Encoding encoding = Encoding::ascii;
  std::uint32_t data_line = 0;  // lines before the data
  std::size_t data_offset = 0;  // [bytes]
};
/// Errors (`where` is the file and the line): `corrupt_data`.
/// @param content  of the file, or its beginning
[[nodiscard]] Result<Header> read_header(std::string_view content, const std::string& file,
                                         ReadTimes read_times);

/// Whether a line may begin with this word: it is a keyword of the header.
[[nodiscard]] bool is_keyword(std::string_view word) noexcept;

/// Nothing if it does not fit 64 bits.
[[nodiscard]] std::optional<std::uint64_t> product(std::uint64_t a, std::uint64_t b) noexcept;

}  // namespace vantage::io::pcd
