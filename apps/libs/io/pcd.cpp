#include <fmt/format.h>
#include <fmt/ranges.h>
#include <lzf.h>

#include <algorithm>
#include <array>
#include <cstring>
#include <memory>
#include <optional>
#include <span>
#include <utility>
#include <vector>

#include "io/formats.hpp"
#include "io/point_fields.hpp"
#include "io/text.hpp"

namespace vantage::io {
namespace {

enum Keyword : std::uint8_t {
  kVersion,
  kFields,
  kSize,
  kType,
  kCount,
  kWidth,
  kHeight,
  kViewpoint,
  kPoints,
  kData,
};
constexpr std::array<std::string_view, 10> kKeywords{
    "VERSION", "FIELDS", "SIZE", "TYPE", "COUNT", "WIDTH", "HEIGHT", "VIEWPOINT", "POINTS", "DATA"};

std::optional<Keyword> keyword(std::string_view word) noexcept {
  if (word == "COLUMNS") return kFields;  // the keyword's name before PCD 0.6
  const auto found = std::find(kKeywords.begin(), kKeywords.end(), word);
  if (found == kKeywords.end()) return std::nullopt;
  return static_cast<Keyword>(found - kKeywords.begin());
}

std::optional<std::uint64_t> product(std::uint64_t a, std::uint64_t b) noexcept {
  std::uint64_t result = 0;
  if (__builtin_mul_overflow(a, b, &result)) return std::nullopt;
  return result;
}

struct Field {
  std::string_view name;
  char type = 0;             // I, U or F
  std::uint64_t size = 0;    // [bytes] of one value
  std::uint64_t count = 1;   // values
  std::uint64_t offset = 0;  // of the first value in a point [bytes]
  std::uint64_t column = 0;  // of the first value in a line
};

enum class Encoding : std::uint8_t { ascii, binary, binary_compressed };

struct Header {
  std::vector<Field> fields;
  std::array<Field, 3> axes;  // x, y, z
  std::optional<Field> time;
  TimeFormat time_format;
  std::uint64_t point_size = 0;  // [bytes]
  std::uint64_t columns = 0;     // values per point
  std::uint64_t points = 0;
  Encoding encoding = Encoding::ascii;
  std::uint32_t data_line = 0;  // lines before the data
  std::size_t data_offset = 0;  // [bytes]
};

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

class HeaderReader {
 public:
  HeaderReader(std::string_view content, const std::string& file, ReadTimes read_times) noexcept
      : content_(content), lines_(content), file_(file), read_times_(read_times) {}

  [[nodiscard]] Result<Header> read() {
    VANTAGE_CHECK(collect());
    Header header;
    header.data_line = lines_.line();
    header.data_offset = lines_.offset();
    VANTAGE_TRY(header.encoding, encoding());
    VANTAGE_TRY(header.fields, fields());
    for (Field& field : header.fields) {
      field.offset = header.point_size;
      field.column = header.columns;
      const auto bytes = product(field.size, field.count);
      if (!bytes || __builtin_add_overflow(header.point_size, *bytes, &header.point_size)) {
        return error(kCount, "the size of a point does not fit 64 bits");
      }
      header.columns += field.count;  // cannot overflow if the number of bytes did not
    }
    VANTAGE_TRY(header.axes, axes(header.fields));
    if (read_times_ == ReadTimes::yes) VANTAGE_CHECK(find_time(header));
    VANTAGE_TRY(header.points, points());
    return header;
  }

 private:
  struct Entry {
    std::uint32_t line = 0;  // 0: the keyword is missing
    std::string_view values;
  };

  [[nodiscard]] tl::unexpected<Error> error(std::uint32_t line, std::string message) const {
    return fail(ErrorCode::corrupt_data, std::move(message), SourceLocation{file_, line, 0});
  }
  [[nodiscard]] tl::unexpected<Error> error(Keyword key, std::string message) const {
    return error(entries_[key].line, std::move(message));
  }

  // Finds the line of every keyword up to DATA.
  [[nodiscard]] Result<void> collect() {
    while (const auto line = lines_.next()) {
      // A header line ends with a line feed; a line that the end of the file cuts off is not
      // complete.
      if (content_[lines_.offset() - 1] != '\n') break;
      if (is_blank_or_comment(*line)) continue;
      WordReader words(*line);
      const std::string_view word = words.next();
      const auto key = keyword(word);
      if (!key) {
        return error(lines_.line(), fmt::format("expected a PCD header line ({}), found {}",
                                                fmt::join(kKeywords, ", "), quoted(*line)));
      }
      if (entries_[*key].line != 0) {
        return error(lines_.line(), fmt::format("second {} line, the first is line {}",
                                                kKeywords[*key], entries_[*key].line));
      }
      const auto values_at = static_cast<std::size_t>(word.data() + word.size() - line->data());
      entries_[*key] = {lines_.line(), line->substr(values_at)};
      if (*key == kData) return {};
    }
    return error(lines_.line(), fmt::format("the file ends at byte {} inside the PCD header, "
                                            "expected a DATA line",
                                            lines_.offset()));
  }

  // The values of a line that has one value per field.
  [[nodiscard]] Result<std::vector<std::string_view>> list(Keyword key) const {
    if (entries_[key].line == 0) {
      return error(0, fmt::format("the PCD header has no {} line", kKeywords[key]));
    }
    std::vector<std::string_view> values;
    WordReader words(entries_[key].values);
    for (auto word = words.next(); !word.empty(); word = words.next()) values.push_back(word);
    return values;
  }

  [[nodiscard]] Result<std::optional<std::uint64_t>> number(Keyword key) const {
    if (entries_[key].line == 0) return std::nullopt;
    WordReader words(entries_[key].values);
    const auto value = parse_number<std::uint64_t>(words.next());
    if (!value || !words.next().empty()) {
      return error(key,
                   fmt::format("{} must be one whole number that is not negative, found {}",
                               kKeywords[key], quoted(WordReader(entries_[key].values).next())));
    }
    return value;
  }

  [[nodiscard]] Result<Encoding> encoding() const {
    WordReader words(entries_[kData].values);
    const std::string_view word = words.next();
    if (word == "ascii") return Encoding::ascii;
    if (word == "binary") return Encoding::binary;
    if (word == "binary_compressed") return Encoding::binary_compressed;
    return error(kData, fmt::format("DATA must be ascii, binary or binary_compressed, found {}",
                                    quoted(word)));
  }

  [[nodiscard]] Result<std::vector<Field>> fields() const {
    VANTAGE_TRY(const auto names, list(kFields));
    VANTAGE_TRY(const auto sizes, list(kSize));
    VANTAGE_TRY(const auto types, list(kType));
    std::vector<std::string_view> counts(names.size(), "1");
    if (entries_[kCount].line != 0) {
      VANTAGE_TRY(counts, list(kCount));
    }
    for (const auto& [key, values] :
         {std::pair{kSize, sizes.size()}, std::pair{kType, types.size()},
          std::pair{kCount, counts.size()}}) {
      if (values == names.size()) continue;
      return error(key, fmt::format("{} has {} values, expected one for each of the {} fields",
                                    kKeywords[key], values, names.size()));
    }
    std::vector<Field> fields(names.size());
    for (std::size_t i = 0; i < names.size(); ++i) {
      Field& field = fields[i];
      field.name = names[i];
      const auto size = parse_number<std::uint64_t>(sizes[i]);
      if (!size || (*size != 1 && *size != 2 && *size != 4 && *size != 8)) {
        return error(kSize, fmt::format("the size of field {} must be 1, 2, 4 or 8, found {}",
                                        quoted(names[i]), quoted(sizes[i])));
      }
      field.size = *size;
      if (types[i] != "I" && types[i] != "U" && types[i] != "F") {
        return error(kType, fmt::format("the type of field {} must be I, U or F, found {}",
                                        quoted(names[i]), quoted(types[i])));
      }
      field.type = types[i].front();
      const auto count = parse_number<std::uint64_t>(counts[i]);
      if (!count || *count == 0) {
        return error(kCount,
                     fmt::format("the count of field {} must be a positive whole number, found {}",
                                 quoted(names[i]), quoted(counts[i])));
      }
      field.count = *count;
    }
    return fields;
  }

  [[nodiscard]] Result<std::array<Field, 3>> axes(std::span<const Field> fields) const {
    std::array<Field, 3> axes;
    for (std::size_t axis = 0; axis < 3; ++axis) {
      const auto find = [&](std::string_view name, auto from) {
        return std::find_if(from, fields.end(), [&](const Field& f) { return f.name == name; });
      };
      std::string_view name = kAxisNames[axis];
      auto found = find(name, fields.begin());
      if (found == fields.end()) {
        name = kUpperAxisNames[axis];
        found = find(name, fields.begin());
      }
      if (found == fields.end()) {
        return error(kFields, fmt::format("no field {} or {}; a point cloud needs x, y and z",
                                          kAxisNames[axis], kUpperAxisNames[axis]));
      }
      if (find(name, found + 1) != fields.end()) {
        return error(kFields, fmt::format("two fields are named {}", name));
      }
      VANTAGE_CHECK(check_number(*found));
      axes[axis] = *found;
    }
    return axes;
  }

  [[nodiscard]] Result<void> find_time(Header& header) const {
    for (const Field& field : header.fields) {
      const auto format = time_format(field.name, field.type == 'F', field.size);
      if (!format) continue;
      if (header.time && header.time_format.preference <= format->preference) continue;
      header.time = field;
      header.time_format = *format;
    }
    if (header.time) VANTAGE_CHECK(check_number(*header.time));
    return {};
  }

  /// Checks that a point has exactly one number there.
  [[nodiscard]] Result<void> check_number(const Field& field) const {
    if (field.count != 1) {
      return error(kCount,
                   fmt::format("field {} has {} values, expected 1", field.name, field.count));
    }
    if (field.type == 'F' && field.size < 4) {
      return error(kSize, fmt::format("field {} of type F has size {}, expected 4 or 8", field.name,
                                      field.size));
    }
    return {};
  }

  [[nodiscard]] Result<std::uint64_t> points() const {
    VANTAGE_TRY(const auto width, number(kWidth));
    VANTAGE_TRY(const auto height, number(kHeight));
    VANTAGE_TRY(const auto points, number(kPoints));
    if (!width && !points) return error(0, "the PCD header has neither a WIDTH nor a POINTS line");
    if (!width) return *points;
    const auto area = product(*width, height.value_or(1));
    if (!area) {
      return error(kWidth, fmt::format("WIDTH * HEIGHT = {} * {} points do not fit 64 bits", *width,
                                       height.value_or(1)));
    }
    if (points && *points != *area) {
      return error(kPoints, fmt::format("POINTS is {}, expected WIDTH * HEIGHT = {} * {} = {}",
                                        *points, *width, height.value_or(1), *area));
    }
    return *area;
  }

  std::string_view content_;
  LineReader lines_;
  const std::string& file_;
  ReadTimes read_times_;
  std::array<Entry, kKeywords.size()> entries_{};
};

/// A cloud without points, and what the times will mean.
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

Result<LoadedCloud> parse_binary(std::string_view content, const std::string& file,
                                 const Header& header) {
  const auto needed = product(header.points, header.point_size);
  const std::size_t available = content.size() - header.data_offset;
  if (!needed || *needed > available) {
    return fail(ErrorCode::corrupt_data,
                fmt::format("the file ends at byte {}, expected {} points of {} bytes from byte {} "
                            "on but there is room for {}",
                            content.size(), header.points, header.point_size, header.data_offset,
                            available / header.point_size),
                SourceLocation{file, 0, 0});
  }
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

}  // namespace

bool looks_like_pcd(std::string_view content) noexcept {
  if (content.starts_with("# .PCD")) return true;
  LineReader lines(content);
  while (const auto line = lines.next()) {
    if (!is_blank_or_comment(*line)) return keyword(WordReader(*line).next()).has_value();
  }
  return false;
}

std::optional<Records> pcd_records(std::string_view head, std::size_t size, ReadTimes read_times) {
  const std::string nameless;
  const auto header = HeaderReader(head, nameless, read_times).read();
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

Result<CloudLayout> pcd_layout(std::string_view content, const std::string& file) {
  VANTAGE_TRY(const Header header, HeaderReader(content, file, ReadTimes::no).read());
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

Result<LoadedCloud> parse_pcd(std::string_view content, const std::string& file,
                              ReadTimes read_times) {
  VANTAGE_TRY(const Header header, HeaderReader(content, file, read_times).read());
  switch (header.encoding) {
    case Encoding::ascii: return parse_ascii(content, file, header);
    case Encoding::binary: return parse_binary(content, file, header);
    case Encoding::binary_compressed: return parse_compressed(content, file, header);
  }
  return fail(ErrorCode::internal, "unknown PCD encoding");
}

}  // namespace vantage::io
