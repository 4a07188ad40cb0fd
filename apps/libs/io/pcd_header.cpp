#include "io/pcd_header.hpp"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <utility>

#include "io/text.hpp"

namespace vantage::io::pcd {
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
  if (word == "COLUMNS") return kFields;  // its name before PCD 0.6
  const auto found = std::find(kKeywords.begin(), kKeywords.end(), word);
  if (found == kKeywords.end()) return std::nullopt;
  return static_cast<Keyword>(found - kKeywords.begin());
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
      header.columns += field.count;  // cannot overflow where the bytes did not
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
      // A header line ends with a line feed; one that the end of the file cuts short is not whole.
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

  // The values of a line that has one for each field.
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

  /// Whether a point has one number there.
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

}  // namespace

Result<Header> read_header(std::string_view content, const std::string& file,
                           ReadTimes read_times) {
  return HeaderReader(content, file, read_times).read();
}

bool is_keyword(std::string_view word) noexcept { return keyword(word).has_value(); }

std::optional<std::uint64_t> product(std::uint64_t a, std::uint64_t b) noexcept {
  std::uint64_t result = 0;
  if (__builtin_mul_overflow(a, b, &result)) return std::nullopt;
  return result;
}
}  // namespace vantage::io::pcd
