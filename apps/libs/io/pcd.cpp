#include <fmt/format.h>
#include <lzf.h>

#include <algorithm>
#include <array>
#include <cstring>
#include <limits>
#include <memory>
#include <optional>
#include <utility>
#include <vector>

#include "io/cloud_formats.hpp"
#include "io/pcd_header.hpp"
#include "io/text.hpp"

namespace vantage::io {
namespace {

using pcd::Encoding;
using pcd::Field;
using pcd::Header;
using pcd::product;

ReadCoordinate reader_of(const Field& field) noexcept {
  constexpr auto kOrder = ByteOrder::little;
  switch (field.type) {
    case 'F':
      if (field.size == 4) return read_coordinate<float, kOrder>;
      return read_coordinate<double, kOrder>;
    case 'I':
      if (field.size == 1) return read_coordinate<std::int8_t, kOrder>;
      if (field.size == 2) return read_coordinate<std::int16_t, kOrder>;
      if (field.size == 4) return read_coordinate<std::int32_t, kOrder>;
      return read_coordinate<std::int64_t, kOrder>;
    default:
      if (field.size == 1) return read_coordinate<std::uint8_t, kOrder>;
      if (field.size == 2) return read_coordinate<std::uint16_t, kOrder>;
      if (field.size == 4) return read_coordinate<std::uint32_t, kOrder>;
      return read_coordinate<std::uint64_t, kOrder>;
  }
}
/// No points yet, and what their times will mean.
LoadedCloud empty_cloud(const Header& header) {
  LoadedCloud cloud;
  if (header.time) {
    cloud.times.field = header.time->name;
    cloud.times.format = header.time_format;
  }
  return cloud;
}

Result<LoadedCloud> parse_ascii(std::string_view content, const std::string& file,
                                const Header& header) {
  constexpr std::size_t kShortestLine = 6;  // "0 0 0\n"
  LoadedCloud cloud = empty_cloud(header);
  cloud.points.reserve(std::min<std::uint64_t>(
      header.points, (content.size() - header.data_offset) / kShortestLine + 1));
  LineReader lines(content, header.data_offset, header.data_line);
  const auto error = [&](std::string message) {
    return fail(ErrorCode::corrupt_data, std::move(message), SourceLocation{file, lines.line(), 0});
  };
  std::vector<Field> wanted(header.axes.begin(), header.axes.end());
  if (header.time) wanted.push_back(*header.time);
  std::uint64_t read = 0;
  while (const auto line = lines.next()) {
    if (is_blank_or_comment(*line)) continue;
    if (read == header.points) {
      return error(fmt::format("expected the end of the file after {} points, found {}",
                               header.points, quoted(*line)));
    }
    WordReader words(*line);
    std::array<double, 4> values{};  // x, y, z, time
    std::uint64_t column = 0;
    for (auto word = words.next(); !word.empty(); word = words.next(), ++column) {
      for (std::size_t k = 0; k < wanted.size(); ++k) {
        if (wanted[k].column != column) continue;
        const auto value = parse_number<double>(word);
        if (!value) {
          return error(
              fmt::format("expected a number for {}, found {}", wanted[k].name, quoted(word)));
        }
        values[k] = *value;
      }
    }
    if (column != header.columns) {
      return error(fmt::format("expected {} values for point {} of {}, found {}", header.columns,
                               read + 1, header.points, column));
    }
    ++read;
    const Point point(values[0], values[1], values[2]);
    if (point.allFinite()) {
      cloud.points.push_back(point);
      if (header.time) cloud.times.values.push_back(values[3]);
    } else {
      ++cloud.dropped;
    }
  }
  if (read != header.points) {
    return error(fmt::format("the file ends at byte {} after {} points, expected {}",
                             content.size(), read, header.points));
  }
  return cloud;
}

/// @param column  CoordinateColumn(const Field&)
template <class ColumnOf>
LoadedCloud load(const Header& header, const ColumnOf& column) {
  PointColumns columns;
  std::transform(header.axes.begin(), header.axes.end(), columns.axes.begin(), column);
  if (header.time) columns.time = column(*header.time);
  LoadedCloud cloud = empty_cloud(header);
  add_columns(cloud, columns, header.points);
  return cloud;
}

/// Errors: `corrupt_data` for a file that is too short for its points.
/// @param size  of the file [bytes]
Result<void> check_size(const Header& header, std::size_t size, const std::string& file) {
  const auto needed = product(header.points, header.point_size);
  const std::size_t available = size - header.data_offset;
  if (needed && *needed <= available) return {};
  return fail(ErrorCode::corrupt_data,
              fmt::format("the file ends at byte {}, expected {} points of {} bytes from byte {} "
                          "on but there is room for {}",
                          size, header.points, header.point_size, header.data_offset,
                          available / header.point_size),
              SourceLocation{file, 0, 0});
}

Result<LoadedCloud> parse_binary(std::string_view content, const std::string& file,
                                 const Header& header) {
  VANTAGE_CHECK(check_size(header, content.size(), file));
  return load(header, [&](const Field& field) {
    return CoordinateColumn{content.data() + header.data_offset + field.offset, header.point_size,
                            reader_of(field)};
  });
}

// After the header come the compressed and the uncompressed size as uint32, then the compressed
// bytes, which contain all values of the first field, then all values of the second, ...
Result<LoadedCloud> parse_compressed(std::string_view content, const std::string& file,
                                     const Header& header) {
  // The longest back reference of LZF: 3 bytes stand for 264.
  constexpr std::uint64_t kLargestExpansion = 88;
  const auto error = [&](std::string message) {
    return fail(ErrorCode::corrupt_data, std::move(message), SourceLocation{file, 0, 0});
  };
  if (header.points == 0) return empty_cloud(header);

  std::array<std::uint32_t, 2> sizes{};
  const std::string_view data = content.substr(header.data_offset);
  if (data.size() < sizeof(sizes)) {
    return error(
        fmt::format("the file ends at byte {}, expected the two sizes of the compressed "
                    "data at byte {}",
                    content.size(), header.data_offset));
  }
  std::memcpy(sizes.data(), data.data(), sizeof(sizes));
  const auto [compressed, uncompressed] = sizes;
  if (compressed > data.size() - sizeof(sizes)) {
    return error(
        fmt::format("the file ends at byte {}, expected {} bytes of compressed data from "
                    "byte {} on",
                    content.size(), compressed, header.data_offset + sizeof(sizes)));
  }
  if (product(header.points, header.point_size) != uncompressed) {
    return error(
        fmt::format("the data at byte {} claim {} bytes uncompressed, expected {} points "
                    "of {} bytes",
                    header.data_offset, uncompressed, header.points, header.point_size));
  }
  if (uncompressed > kLargestExpansion * compressed) {
    return error(
        fmt::format("the data at byte {} claim {} bytes uncompressed, which {} compressed "
                    "bytes cannot hold",
                    header.data_offset, uncompressed, compressed));
  }
  const auto bytes = std::make_unique_for_overwrite<char[]>(uncompressed);
  if (lzf_decompress(data.data() + sizeof(sizes), compressed, bytes.get(), uncompressed) !=
      uncompressed) {
    return error(
        fmt::format("the compressed data at byte {} are damaged, expected {} bytes of LZF "
                    "that give {} bytes",
                    header.data_offset + sizeof(sizes), compressed, uncompressed));
  }
  return load(header, [&](const Field& field) {
    return CoordinateColumn{bytes.get() + field.offset * header.points, field.size,
                            reader_of(field)};
  });
}

/// Where the points of a sound binary file are; nothing for any other file.
/// @param size  of the file [bytes]
std::optional<Records> records_in(std::string_view head, std::size_t size, ReadTimes read_times) {
  const std::string nameless;
  const auto header = pcd::read_header(head, nameless, read_times);
  if (!header || header->encoding != Encoding::binary) return std::nullopt;
  const auto needed = product(header->points, header->point_size);
  if (!needed || *needed > size - header->data_offset) return std::nullopt;
  Records records;
  records.offset = header->data_offset;
  records.size = header->point_size;
  records.count = header->points;
  const auto place = [](const Field& field) {
    return Records::Field{field.offset, reader_of(field)};
  };
  std::transform(header->axes.begin(), header->axes.end(), records.axes.begin(), place);
  if (header->time) {
    records.time = place(*header->time);
    records.time_name = header->time->name;
    records.time_format = header->time_format;
  }
  return records;
}

Result<LoadedCloud> parse(std::string_view content, const std::string& file, ReadTimes read_times) {
  VANTAGE_TRY(const Header header, pcd::read_header(content, file, read_times));
  switch (header.encoding) {
    case Encoding::ascii: return parse_ascii(content, file, header);
    case Encoding::binary: return parse_binary(content, file, header);
    case Encoding::binary_compressed: return parse_compressed(content, file, header);
  }
  return fail(ErrorCode::internal, "unknown PCD encoding");
}

}  // namespace

bool looks_like_pcd(std::string_view content) noexcept {
  if (content.starts_with("# .PCD")) return true;
  LineReader lines(content);
  while (const auto line = lines.next()) {
    if (!is_blank_or_comment(*line)) return pcd::is_keyword(WordReader(*line).next());
  }
  return false;
}

Result<LoadedCloud> read_pcd(CloudFile& file, ReadTimes read_times) {
  return read_blocks_or_all(file, read_times, records_in, parse);
}

Result<CloudParts> pcd_parts(const CloudFile& file) {
  constexpr std::uint64_t kShortestLine = 6;  // "0 0 0\n"
  const std::uint64_t size = file.input().size();
  const auto header = pcd::read_header(file.head(), file.name(), ReadTimes::no);
  if (!header) {
    if (file.is_all_head()) return fail(header.error());
    return CloudParts{.records = {}, .points = 0, .memory = memory_of(size, size / kShortestLine)};
  }
  CloudParts parts{.records = {}, .points = header->points, .memory = 0};
  switch (header->encoding) {
    case Encoding::ascii:
      parts.memory = memory_of(size, std::min(header->points, size / kShortestLine));
      break;
    case Encoding::binary:
      VANTAGE_CHECK(check_size(*header, size, file.name()));
      parts.records = records_in(file.head(), size, ReadTimes::no);
      break;
    case Encoding::binary_compressed: {
      // Its size is stated in 32 bits; a reader refuses a file that states another.
      constexpr std::uint64_t kMost = std::numeric_limits<std::uint32_t>::max();
      const std::uint64_t bytes =
          std::min(product(header->points, header->point_size).value_or(kMost), kMost);
      parts.memory = memory_of(size + bytes, bytes / header->point_size);
      break;
    }
  }
  return parts;
}

Result<CloudLayout> pcd_layout(const CloudFile& file) {
  VANTAGE_TRY(const Header header, pcd::read_header(file.head(), file.name(), ReadTimes::no));
  constexpr std::array<std::string_view, 3> kEncodings{"ascii", "binary", "binary_compressed"};
  CloudLayout layout;
  layout.format = fmt::format("PCD ({})", kEncodings[static_cast<std::size_t>(header.encoding)]);
  for (const Field& field : header.fields) {
    const std::string_view kind = field.type == 'F' ? "float" : field.type == 'U' ? "uint" : "int";
    layout.fields.push_back(fmt::format("{} {}{}", field.name, kind, 8 * field.size) +
                            (field.count > 1 ? fmt::format("[{}]", field.count) : ""));
  }
  return layout;
}

}  // namespace vantage::io
