#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <optional>
#include <utility>

#include "io/cloud_formats.hpp"
#include "io/ply_header.hpp"
#include "io/text.hpp"

namespace vantage::io {
namespace {

using ply::Element;
using ply::Encoding;
using ply::Header;
using ply::kVertex;
using ply::Property;
using ply::Scalar;

/// x, y, z and the time of a vertex, read one after the other.
struct Vertex {
  std::array<double, 4> values{};

  /// Where the value of a property goes; null if the property is not wanted.
  [[nodiscard]] double* place(const Element& element, std::size_t property) noexcept {
    if (element.name != kVertex) return nullptr;
    if (element.time == property) return &values[3];
    const auto axis = std::find(element.axes.begin(), element.axes.end(), property);
    if (axis == element.axes.end()) return nullptr;
    return &values[static_cast<std::size_t>(axis - element.axes.begin())];
  }
};

/// A cloud without points, and what the times will mean.
LoadedCloud empty_cloud(const Header& header) {
  LoadedCloud cloud;
  for (const Element& element : header.elements) {
    if (!element.time) continue;
    cloud.times.field = element.properties[*element.time].name;
    cloud.times.format = element.time_format;
  }
  return cloud;
}

void add(LoadedCloud& cloud, const Vertex& vertex, bool has_time) {
  const auto& [x, y, z, time] = vertex.values;
  const Point point(x, y, z);
  if (point.allFinite()) {
    cloud.points.push_back(point);
    if (has_time) cloud.times.values.push_back(time);
  } else {
    ++cloud.dropped;
  }
}

class AsciiReader {
 public:
  AsciiReader(std::string_view content, const std::string& file, const Header& header) noexcept
      : content_(content),
        lines_(content, header.data_offset, header.data_line),
        header_(header),
        file_(file) {}

  [[nodiscard]] Result<LoadedCloud> read() {
    LoadedCloud cloud = empty_cloud(header_);
    for (const Element& element : header_.elements) {
      if (element.properties.empty()) continue;
      if (element.name == kVertex) {
        // An element takes at least a digit and a blank or line end for each of its values.
        cloud.points.reserve(std::min<std::uint64_t>(
            element.count,
            (content_.size() - lines_.offset()) / (2 * element.properties.size()) + 1));
      }
      for (std::uint64_t i = 0; i < element.count; ++i) {
        const auto line = next_line();
        if (!line) {
          return error(fmt::format("the file ends at byte {} after {} of {} elements {}",
                                   content_.size(), i, element.count, quoted(element.name)));
        }
        VANTAGE_TRY(const Vertex vertex, read_line(*line, element));
        if (element.name == kVertex) add(cloud, vertex, element.time.has_value());
      }
    }
    if (const auto line = next_line()) {
      return error(fmt::format("expected the end of the file, found {}", quoted(*line)));
    }
    return cloud;
  }

 private:
  [[nodiscard]] tl::unexpected<Error> error(std::string message) const {
    return fail(ErrorCode::corrupt_data, std::move(message),
                SourceLocation{file_, lines_.line(), 0});
  }

  [[nodiscard]] std::optional<std::string_view> next_line() noexcept {
    while (const auto line = lines_.next()) {
      if (!WordReader(*line).next().empty()) return line;
    }
    return std::nullopt;
  }

  // For an element that is not a vertex, the result has no meaning.
  [[nodiscard]] Result<Vertex> read_line(std::string_view line, const Element& element) const {
    WordReader words(line);
    Vertex vertex;
    for (std::size_t i = 0; i < element.properties.size(); ++i) {
      const Property& property = element.properties[i];
      const std::string_view word = words.next();
      if (word.empty()) {
        return error(fmt::format("the line ends before property {} of element {}",
                                 quoted(property.name), quoted(element.name)));
      }
      if (property.length_type != nullptr) {
        const auto length = parse_number<std::uint64_t>(word);
        if (!length) {
          return error(fmt::format("expected the length of list {}, found {}",
                                   quoted(property.name), quoted(word)));
        }
        for (std::uint64_t k = 0; k < *length; ++k) {
          if (!words.next().empty()) continue;
          return error(fmt::format("the line ends after {} of {} values of list {}", k, *length,
                                   quoted(property.name)));
        }
        continue;
      }
      double* const place = vertex.place(element, i);
      if (place == nullptr) continue;
      const auto value = parse_number<double>(word);
      if (!value) {
        return error(
            fmt::format("expected a number for {}, found {}", property.name, quoted(word)));
      }
      *place = *value;
    }
    if (const auto extra = words.count(); extra > 0) {
      return error(fmt::format("{} more values than element {} has", extra, quoted(element.name)));
    }
    return vertex;
  }

  std::string_view content_;
  LineReader lines_;
  const Header& header_;
  const std::string& file_;
};

class BinaryReader {
 public:
  BinaryReader(std::string_view content, const std::string& file, const Header& header) noexcept
      : content_(content), offset_(header.data_offset), header_(header), file_(file) {}

  [[nodiscard]] Result<LoadedCloud> read() {
    LoadedCloud cloud = empty_cloud(header_);
    for (const Element& element : header_.elements) {
      if (element.has_list) {
        VANTAGE_CHECK(walk(element, cloud));
        continue;
      }
      std::uint64_t bytes = 0;
      if (__builtin_mul_overflow(element.count, element.size, &bytes) || bytes > rest()) {
        return too_short(element, fmt::format("{} elements of {} bytes from byte {} on",
                                              element.count, element.size, offset_));
      }
      if (element.name == kVertex) {
        const auto column = [&](std::size_t index) {
          const Property& property = element.properties[index];
          return CoordinateColumn{content_.data() + offset_ + property.offset, element.size,
                                  property.type->reader(header_.encoding)};
        };
        PointColumns columns;
        std::transform(element.axes.begin(), element.axes.end(), columns.axes.begin(), column);
        if (element.time) columns.time = column(*element.time);
        add_columns(cloud, columns, element.count);
      }
      offset_ += bytes;
    }
    return cloud;
  }

 private:
  [[nodiscard]] std::size_t rest() const noexcept { return content_.size() - offset_; }

  [[nodiscard]] tl::unexpected<Error> too_short(const Element& element,
                                                const std::string& expected) const {
    return fail(ErrorCode::corrupt_data,
                fmt::format("the file ends at byte {} inside element {}, expected {}",
                            content_.size(), quoted(element.name), expected),
                SourceLocation{file_, 0, 0});
  }

  // Walks through elements of different lengths, one by one.
  [[nodiscard]] Result<void> walk(const Element& element, LoadedCloud& cloud) {
    for (std::uint64_t i = 0; i < element.count; ++i) {
      Vertex vertex;
      for (std::size_t k = 0; k < element.properties.size(); ++k) {
        const Property& property = element.properties[k];
        std::uint64_t values = 1;
        if (property.length_type != nullptr) {
          VANTAGE_TRY(const double length, take(*property.length_type, element, i));
          if (length < 0.0) {
            return fail(
                ErrorCode::corrupt_data,
                fmt::format("list {} of element {} {} before byte {} has length {}, "
                            "expected none below 0",
                            quoted(property.name), quoted(element.name), i, offset_, length),
                SourceLocation{file_, 0, 0});
          }
          // Any length that does not fit may be replaced by a length beyond the end of the file.
          const auto longest = static_cast<double>(content_.size());
          values = static_cast<std::uint64_t>(std::min(length, longest));
        }
        const std::uint64_t bytes = values * property.type->size;
        if (bytes > rest()) return too_short(element, expectation(bytes, element, i));
        if (double* const place = vertex.place(element, k)) {
          *place = property.type->reader(header_.encoding)(content_.data() + offset_);
        }
        offset_ += bytes;
      }
      if (element.name == kVertex) add(cloud, vertex, element.time.has_value());
    }
    return {};
  }

  [[nodiscard]] Result<double> take(const Scalar& type, const Element& element, std::uint64_t i) {
    if (type.size > rest()) return too_short(element, expectation(type.size, element, i));
    const double value = type.reader(header_.encoding)(content_.data() + offset_);
    offset_ += type.size;
    return value;
  }

  [[nodiscard]] std::string expectation(std::uint64_t bytes, const Element& element,
                                        std::uint64_t i) const {
    return fmt::format("{} bytes at byte {} for element {} of {}", bytes, offset_, i,
                       element.count);
  }

  std::string_view content_;
  std::size_t offset_;
  const Header& header_;
  const std::string& file_;
};

/// Where the points of a sound binary file are; nothing for any other file.
/// @param size  of the file [bytes]
std::optional<Records> records_in(std::string_view head, std::size_t size, ReadTimes read_times) {
  const std::string nameless;
  const auto header = ply::read_header(head, nameless, read_times);
  if (!header || header->encoding == Encoding::ascii) return std::nullopt;
  Records records;
  std::size_t offset = header->data_offset;
  for (const Element& element : header->elements) {
    std::uint64_t bytes = 0;
    if (element.has_list || __builtin_mul_overflow(element.count, element.size, &bytes) ||
        bytes > size - offset) {
      return std::nullopt;
    }
    if (element.name == kVertex) {
      records.offset = offset;
      records.size = element.size;
      records.count = element.count;
      const auto place = [&](std::size_t index) {
        const Property& property = element.properties[index];
        return Records::Field{property.offset, property.type->reader(header->encoding)};
      };
      std::transform(element.axes.begin(), element.axes.end(), records.axes.begin(), place);
      if (element.time) {
        records.time = place(*element.time);
        records.time_name = element.properties[*element.time].name;
        records.time_format = element.time_format;
      }
    }
    offset += bytes;
  }
  return records;
}

Result<LoadedCloud> parse(std::string_view content, const std::string& file, ReadTimes read_times) {
  VANTAGE_TRY(const Header header, ply::read_header(content, file, read_times));
  if (header.encoding == Encoding::ascii) return AsciiReader(content, file, header).read();
  return BinaryReader(content, file, header).read();
}

}  // namespace

bool looks_like_ply(std::string_view content) noexcept {
  constexpr std::string_view kBlank = " \t\r\n";
  return content.starts_with("ply") &&
         (content.size() == 3 || kBlank.find(content[3]) != std::string_view::npos);
}

Result<LoadedCloud> read_ply(CloudFile& file, ReadTimes read_times) {
  return read_blocks_or_all(file, read_times, records_in, parse);
}

Result<CloudParts> ply_parts(const CloudFile& file) {
  const std::uint64_t size = file.input().size();
  CloudParts parts;
  parts.records = records_in(file.head(), size, ReadTimes::no);
  if (parts.records) {
    parts.points = parts.records->count;
    return parts;
  }
  const auto header = ply::read_header(file.head(), file.name(), ReadTimes::no);
  if (!header && file.is_all_head()) return fail(header.error());
  std::uint64_t most = size / 3;  // a vertex takes a byte for each coordinate, or more
  if (header) {
    for (const Element& element : header->elements) {
      if (element.name == kVertex) parts.points = element.count;
    }
    most = std::min(most, parts.points);
  }
  // The points between lists are added one by one: a growing vector takes up to three times as
  // much.
  const bool grows = header && header->encoding != Encoding::ascii;
  parts.memory = memory_of(size, grows ? 3 * most : most);
  return parts;
}

Result<CloudLayout> ply_layout(const CloudFile& file) {
  VANTAGE_TRY(const Header header, ply::read_header(file.head(), file.name(), ReadTimes::no));
  CloudLayout layout;
  layout.format = header.encoding == Encoding::ascii ? "PLY (ascii)" : "PLY (binary)";
  for (const Element& element : header.elements) {
    if (element.name != kVertex) continue;
    for (const Property& property : element.properties) {
      layout.fields.push_back(fmt::format("{} {}{}", property.name, property.type->name,
                                          property.length_type != nullptr ? "[]" : ""));
    }
  }
  return layout;
}

}  // namespace vantage::io
