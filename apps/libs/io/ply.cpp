#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <optional>
#include <type_traits>
#include <utility>
#include <vector>

#include "io/formats.hpp"
#include "io/point_fields.hpp"
#include "io/text.hpp"

namespace vantage::io {
namespace {

enum class Encoding : std::uint8_t { ascii, binary_little_endian, binary_big_endian };

struct Scalar {
  std::string_view name, other_name;
  std::size_t size;  // [bytes]
  bool is_integer;
  ReadCoordinate read_little, read_big;

  [[nodiscard]] ReadCoordinate reader(Encoding encoding) const noexcept {
    return encoding == Encoding::binary_big_endian ? read_big : read_little;
  }
};

template <class Stored>
constexpr Scalar scalar(std::string_view name, std::string_view other_name) {
  return {name,
          other_name,
          sizeof(Stored),
          std::is_integral_v<Stored>,
          read_coordinate<Stored, ByteOrder::little>,
          read_coordinate<Stored, ByteOrder::big>};
}

constexpr std::array kScalars{
    scalar<std::int8_t>("char", "int8"),    scalar<std::uint8_t>("uchar", "uint8"),
    scalar<std::int16_t>("short", "int16"), scalar<std::uint16_t>("ushort", "uint16"),
    scalar<std::int32_t>("int", "int32"),   scalar<std::uint32_t>("uint", "uint32"),
    scalar<std::int64_t>("int64", "long"),  scalar<std::uint64_t>("uint64", "ulong"),
    scalar<float>("float", "float32"),      scalar<double>("double", "float64"),
};

const Scalar* find_scalar(std::string_view name) noexcept {
  const auto found = std::find_if(kScalars.begin(), kScalars.end(), [&](const Scalar& s) {
    return s.name == name || s.other_name == name;
  });
  return found == kScalars.end() ? nullptr : &*found;
}

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
  std::optional<std::size_t> time;    // of `vertex`: which property, if it exists and is wanted
  TimeFormat time_format;
};

struct Header {
  Encoding encoding = Encoding::ascii;
  std::vector<Element> elements;
  std::uint32_t data_line = 0;  // lines before the data
  std::size_t data_offset = 0;  // [bytes]
};

constexpr std::string_view kVertex = "vertex";

class HeaderReader {
 public:
  HeaderReader(std::string_view content, const std::string& file, ReadTimes read_times) noexcept
      : content_(content), lines_(content), file_(file), read_times_(read_times) {}

  [[nodiscard]] Result<Header> read() {
    Header header;
    const auto first = lines_.next();
    if (!first || WordReader(*first).next() != "ply") {
      return error(fmt::format("expected the line 'ply', found {}", quoted(first.value_or(""))));
    }
    std::optional<Encoding> encoding;
    while (true) {
      const auto line = lines_.next();
      // A header line ends with a line feed; a line that the end of the file cuts off is not
      // complete.
      if (!line || content_[lines_.offset() - 1] != '\n') {
        return error(fmt::format(
            "the file ends at byte {} inside the PLY header, expected the line 'end_header'",
            content_.size()));
      }
      WordReader words(*line);
      const std::string_view word = words.next();
      if (word.empty() || word == "comment" || word == "obj_info") continue;
      if (word == "end_header") break;
      if (word == "format") {
        VANTAGE_TRY(encoding, read_encoding(words));
      } else if (word == "element") {
        VANTAGE_CHECK(read_element(words, header.elements));
      } else if (word == "property") {
        VANTAGE_CHECK(read_property(words, header.elements));
      } else {
        return error(
            fmt::format("expected a PLY header line (format, element, property, comment, "
                        "end_header), found {}",
                        quoted(*line)));
      }
    }
    if (!encoding) return error("the PLY header has no format line");
    header.encoding = *encoding;
    header.data_line = lines_.line();
    header.data_offset = lines_.offset();
    VANTAGE_CHECK(find_axes(header.elements));
    return header;
  }

 private:
  [[nodiscard]] tl::unexpected<Error> error(std::string message) const {
    return fail(ErrorCode::corrupt_data, std::move(message),
                SourceLocation{file_, lines_.line(), 0});
  }

  [[nodiscard]] Result<Encoding> read_encoding(WordReader words) const {
    const std::string_view word = words.next();
    const std::string_view version = words.next();
    if (version != "1.0") {
      return error(fmt::format("expected PLY version 1.0, found {}", quoted(version)));
    }
    if (word == "ascii") return Encoding::ascii;
    if (word == "binary_little_endian") return Encoding::binary_little_endian;
    if (word == "binary_big_endian") return Encoding::binary_big_endian;
    return error(fmt::format(
        "format must be ascii, binary_little_endian or binary_big_endian, found {}", quoted(word)));
  }

  [[nodiscard]] Result<void> read_element(WordReader words, std::vector<Element>& elements) const {
    const std::string_view name = words.next();
    const std::string_view count_word = words.next();
    const auto count = parse_number<std::uint64_t>(count_word);
    if (!count || !words.next().empty()) {
      return error(fmt::format(
          "expected 'element <name> <count>' with a whole number that is not negative, found {}",
          quoted(count_word)));
    }
    for (const Element& element : elements) {
      if (element.name == name) return error(fmt::format("second element {}", quoted(name)));
    }
    Element element;
    element.name = name;
    element.count = *count;
    elements.push_back(std::move(element));
    return {};
  }

  [[nodiscard]] Result<const Scalar*> read_scalar(std::string_view word) const {
    const Scalar* type = find_scalar(word);
    if (type == nullptr) {
      return error(
          fmt::format("expected a type (char, uchar, short, ushort, int, uint, float, "
                      "double), found {}",
                      quoted(word)));
    }
    return type;
  }

  [[nodiscard]] Result<void> read_property(WordReader words, std::vector<Element>& elements) const {
    if (elements.empty()) return error("property before the first element");
    Element& element = elements.back();
    Property property;
    std::string_view word = words.next();
    if (word == "list") {
      VANTAGE_TRY(property.length_type, read_scalar(words.next()));
      if (!property.length_type->is_integer) {
        return error(fmt::format("the length of a list must be an integer, found {}",
                                 property.length_type->name));
      }
      word = words.next();
    }
    VANTAGE_TRY(property.type, read_scalar(word));
    property.name = words.next();
    if (property.name.empty() || !words.next().empty()) {
      return error("expected 'property <type> <name>' or 'property list <type> <type> <name>'");
    }
    for (const Property& other : element.properties) {
      if (other.name == property.name) {
        return error(fmt::format("second property {} of element {}", quoted(property.name),
                                 quoted(element.name)));
      }
    }
    property.offset = element.size;
    if (property.length_type != nullptr) {
      element.has_list = true;
    } else {
      element.size += property.type->size;
    }
    element.properties.push_back(property);
    return {};
  }

  [[nodiscard]] Result<void> find_axes(std::vector<Element>& elements) const {
    const auto vertex = std::find_if(elements.begin(), elements.end(),
                                     [](const Element& e) { return e.name == kVertex; });
    if (vertex == elements.end()) return error("the PLY header has no element 'vertex'");
    const auto& properties = vertex->properties;
    for (std::size_t axis = 0; axis < 3; ++axis) {
      auto found = properties.end();
      for (const auto name : {kAxisNames[axis], kUpperAxisNames[axis]}) {
        if (found != properties.end()) break;
        found = std::find_if(properties.begin(), properties.end(),
                             [&](const Property& p) { return p.name == name; });
      }
      if (found == properties.end()) {
        return error(
            fmt::format("element 'vertex' has no property {}; a point cloud needs x, y and z",
                        kAxisNames[axis]));
      }
      if (found->length_type != nullptr) {
        return error(fmt::format("property {} of element 'vertex' is a list, expected one number",
                                 found->name));
      }
      vertex->axes[axis] = static_cast<std::size_t>(found - properties.begin());
    }
    if (read_times_ == ReadTimes::yes) return find_time(*vertex);
    return {};
  }

  [[nodiscard]] Result<void> find_time(Element& vertex) const {
    for (std::size_t i = 0; i < vertex.properties.size(); ++i) {
      const Property& property = vertex.properties[i];
      const auto format =
          time_format(property.name, !property.type->is_integer, property.type->size);
      if (!format) continue;
      if (vertex.time && vertex.time_format.preference <= format->preference) continue;
      vertex.time = i;
      vertex.time_format = *format;
    }
    if (vertex.time && vertex.properties[*vertex.time].length_type != nullptr) {
      return error(fmt::format("property {} of element 'vertex' is a list, expected one number",
                               vertex.properties[*vertex.time].name));
    }
    return {};
  }

  std::string_view content_;
  LineReader lines_;
  const std::string& file_;
  ReadTimes read_times_;
};

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

}  // namespace

bool looks_like_ply(std::string_view content) noexcept {
  constexpr std::string_view kBlank = " \t\r\n";
  return content.starts_with("ply") &&
         (content.size() == 3 || kBlank.find(content[3]) != std::string_view::npos);
}

std::optional<Records> ply_records(std::string_view head, std::size_t size, ReadTimes read_times) {
  const std::string nameless;
  const auto header = HeaderReader(head, nameless, read_times).read();
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

Result<CloudLayout> ply_layout(std::string_view content, const std::string& file) {
  VANTAGE_TRY(const Header header, HeaderReader(content, file, ReadTimes::no).read());
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

Result<LoadedCloud> parse_ply(std::string_view content, const std::string& file,
                              ReadTimes read_times) {
  VANTAGE_TRY(const Header header, HeaderReader(content, file, read_times).read());
  if (header.encoding == Encoding::ascii) return AsciiReader(content, file, header).read();
  return BinaryReader(content, file, header).read();
}

}  // namespace vantage::io
