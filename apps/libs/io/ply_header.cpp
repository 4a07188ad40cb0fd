#include "io/ply_header.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <type_traits>
#include <utility>

#include "io/text.hpp"

namespace vantage::io::ply {
namespace {

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
      // A header line ends with a line feed; one that the end of the file cuts short is not whole.
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

}  // namespace

Result<Header> read_header(std::string_view content, const std::string& file,
                           ReadTimes read_times) {
  return HeaderReader(content, file, read_times).read();
}

}  // namespace vantage::io::ply
