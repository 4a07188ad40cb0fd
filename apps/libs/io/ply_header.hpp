#pragma once

#include <array>
#include <cstdint>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "io/point_fields.hpp"

namespace vantage::io::ply {

enum class Encoding : std::uint8_t { ascii, binary_little_endian, binary_big_endian };

/// A type of numbers.
struct Scalar {
  std::string_view name, other_name;
  std::size_t size;  // [bytes]
  bool is_integer;
  ReadCoordinate read_little, read_big;

  [[nodiscard]] ReadCoordinate reader(Encoding encoding) const noexcept {
    return encoding == Encoding::binary_big_endian ? read_big : read_little;
  }
};
struct Property {
  std::string_view name;
  const Scalar* type = nullptr;
  const Scalar* length_type = nullptr;  // of a list; null for a single value
  std::size_t offset = 0;               // in an element without lists [bytes]
};

struct Element {
  std::string_view name;
  std::uint64_t count = 0;
  std::vector<Property> properties;
  bool has_list = false;
  std::size_t size = 0;               // of the single values [bytes]
  std::array<std::size_t, 3> axes{};  // of `vertex`: which properties are x, y, z
  std::optional<std::size_t> time;  // of `vertex`: which property, if there is one and it is wanted
  TimeFormat time_format;
};

/// What precedes the data of a PLY file; its names are views of the content.
struct Header {
  Encoding encoding = Encoding::ascii;
  std::vector<Element> elements;
  std::uint32_t data_line = 0;  // lines before the data
  std::size_t data_offset = 0;  // [bytes]
};
/// The element whose entries are the points.
inline constexpr std::string_view kVertex = "vertex";

/// Errors (`where` is the file and the line): `corrupt_data`.
/// @param content  of the file, or its beginning
[[nodiscard]] Result<Header> read_header(std::string_view content, const std::string& file,
                                         ReadTimes read_times);

}  // namespace vantage::io::ply
