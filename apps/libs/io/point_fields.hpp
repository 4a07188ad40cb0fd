#pragma once

#include <array>
#include <bit>
#include <cstdint>
#include <cstring>
#include <optional>
#include <string>
#include <string_view>

#include "vantage/io/point_cloud_io.hpp"
#include "vantage/kit/file_content.hpp"

namespace vantage::io {

static_assert(std::endian::native == std::endian::little, "binary files are read in place");

/// Reads one coordinate from its bytes in a file, at any alignment.
using ReadCoordinate = double (*)(const char*) noexcept;

enum class ByteOrder : std::uint8_t { little, big };

template <class Stored, ByteOrder order>
[[nodiscard]] double read_coordinate(const char* bytes) noexcept {
  std::array<char, sizeof(Stored)> raw;
  if constexpr (order == ByteOrder::little) {
    std::memcpy(raw.data(), bytes, raw.size());
  } else {
    for (std::size_t i = 0; i < raw.size(); ++i) raw[i] = bytes[raw.size() - 1 - i];
  }
  return static_cast<double>(std::bit_cast<Stored>(raw));
}

/// The shift of a coordinate that is stored unshifted: unlike 0, it preserves -0.
inline constexpr double kNoShift = -0.0;

/// One coordinate of all points: that of point i is `scale` times the number at
/// `first + i * stride`, plus `shift`.
struct CoordinateColumn {
  const char* first = nullptr;
  std::size_t stride = 0;
  ReadCoordinate read = nullptr;
  double scale = 1.0;
  double shift = kNoShift;
};

struct PointColumns {
  std::array<CoordinateColumn, 3> axes;  // x, y, z
  std::optional<CoordinateColumn> time;
  std::optional<CoordinateColumn> tag;  // uint8
};

template <bool has_time, bool has_tag>
void add_points(LoadedCloud& cloud, const PointColumns& columns, std::size_t count) {
  std::size_t kept = cloud.points.size();
  cloud.points.resize(kept + count);
  if constexpr (has_time) cloud.times.values.resize(kept + count);
  if constexpr (has_tag) cloud.tags.resize(kept + count);
  const auto at = [](const CoordinateColumn& column, std::size_t i) {
    return column.read(column.first + i * column.stride);
  };
  for (std::size_t i = 0; i < count; ++i) {
    Point& point = cloud.points[kept];
    for (std::size_t axis = 0; axis < 3; ++axis) {
      const CoordinateColumn& column = columns.axes[axis];
      point[static_cast<Eigen::Index>(axis)] = at(column, i) * column.scale + column.shift;
    }
    if constexpr (has_time) cloud.times.values[kept] = at(*columns.time, i);
    if constexpr (has_tag) cloud.tags[kept] = static_cast<std::uint8_t>(at(*columns.tag, i));
    const bool finite = point.allFinite();
    kept += finite ? 1 : 0;
    cloud.dropped += finite ? 0 : 1;
  }
  cloud.points.resize(kept);
  if constexpr (has_time) cloud.times.values.resize(kept);
  if constexpr (has_tag) cloud.tags.resize(kept);
}

/// Adds the finite points among `count` points. Precondition: the columns hold `count` points.
inline void add_columns(LoadedCloud& cloud, const PointColumns& columns, std::size_t count) {
  if (columns.tag) {
    columns.time ? add_points<true, true>(cloud, columns, count)
                 : add_points<false, true>(cloud, columns, count);
  } else {
    columns.time ? add_points<true, false>(cloud, columns, count)
                 : add_points<false, false>(cloud, columns, count);
  }
}

/// Precondition: the columns hold `count` points.
[[nodiscard]] inline LoadedCloud load_columns(const PointColumns& columns, std::size_t count) {
  LoadedCloud cloud;
  add_columns(cloud, columns, count);
  return cloud;
}

/// Points of equal size, one after the other in a file.
struct Records {
  struct Field {
    std::size_t offset = 0;  // in a point [bytes]
    ReadCoordinate read = nullptr;
    double scale = 1.0;
    double shift = kNoShift;
  };
  std::size_t offset = 0;  // of the first one in the file [bytes]
  std::size_t size = 0;    // of one [bytes]
  std::size_t count = 0;
  std::array<Field, 3> axes;  // x, y, z
  std::optional<Field> time;
  std::string time_name;
  TimeFormat time_format;
};

/// Reads points in blocks: the whole file is never in memory.
/// Errors: `io_failure`. Precondition: the file contains all the points.
[[nodiscard]] Result<LoadedCloud> load_records(const InputFile& file, const Records& records);

/// Adds the finite ones of `count` points from the point `first` on, through a buffer of 1 MiB (or
/// one point). Errors and precondition: those of load_records.
[[nodiscard]] Result<void> add_records(LoadedCloud& cloud, const InputFile& file,
                                       const Records& records, std::size_t first,
                                       std::size_t count);

inline constexpr std::array<std::string_view, 3> kAxisNames{"x", "y", "z"};
inline constexpr std::array<std::string_view, 3> kUpperAxisNames{"X", "Y", "Z"};

}  // namespace vantage::io
