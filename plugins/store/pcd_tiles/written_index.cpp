#include "written_index.hpp"

#include <charconv>
#include <cmath>
#include <limits>
#include <nlohmann/json.hpp>
#include <utility>

namespace vantage::pcd_tiles {
namespace {

constexpr double kInfinity = std::numeric_limits<double>::infinity();

bool is_white(char c) noexcept { return c == ' ' || c == '\n' || c == '\t' || c == '\r'; }
bool is_digit(char c) noexcept { return c >= '0' && c <= '9'; }

/// Takes expected tokens in order. After the first unexpected token, every call fails.
class Scanner {
 public:
  explicit Scanner(std::string_view text) noexcept : text_(text) {}

  [[nodiscard]] bool ok() const noexcept { return ok_; }
  [[nodiscard]] std::size_t offset() const noexcept { return at_; }
  void refuse() noexcept { ok_ = false; }

  /// Whether the next token is this one; takes it if it is.
  bool take_if(std::string_view token) noexcept {
    skip_white();
    if (!ok_ || !text_.substr(at_).starts_with(token)) return false;
    at_ += token.size();
    return true;
  }
  void take(std::string_view token) noexcept {
    if (!take_if(token)) refuse();
  }
  /// @param quoted  the key with its quotes
  void key(std::string_view quoted) noexcept {
    take(quoted);
    take(":");
  }
  /// A comma and a key.
  void next(std::string_view quoted) noexcept {
    take(",");
    key(quoted);
  }
  /// Whether a list continues: takes the comma if it does, and the end of the list if it does not.
  bool more() noexcept {
    if (take_if(",")) return true;
    take("]");
    return false;
  }

  double number() noexcept {
    if (take_if("\"inf\"")) return kInfinity;
    if (take_if("\"-inf\"")) return -kInfinity;
    return plain_number<double>();
  }
  std::uint64_t count(std::uint64_t max) noexcept {
    const auto value = plain_number<std::uint64_t>();
    if (value > max) refuse();
    return value;
  }
  template <class Vector>
  Vector numbers() noexcept {
    Vector v;
    take("[");
    for (Eigen::Index i = 0; i < v.size(); ++i) {
      if (i > 0) take(",");
      v[i] = number();
    }
    take("]");
    return v;
  }
  std::uint64_t checksum() noexcept {
    const std::string_view digits = text();
    std::uint64_t x = 0;
    const auto [end, error] = std::from_chars(digits.data(), digits.data() + digits.size(), x, 16);
    if (error != std::errc() || end != digits.data() + digits.size() || digits.size() != 16) {
      refuse();
    }
    return x;
  }

  /// A string without escapes.
  std::string_view text() noexcept {
    const std::string_view inside = quoted();
    if (inside.find('\\') != std::string_view::npos) refuse();
    return ok_ ? inside : std::string_view{};
  }
  /// The text between the quotes of a string, with its escapes unchanged.
  std::string_view quoted() noexcept {
    take("\"");
    const std::size_t begin = at_;
    while (ok_ && at_ < text_.size() && text_[at_] != '"') at_ += text_[at_] == '\\' ? 2 : 1;
    if (!ok_ || at_ >= text_.size()) {
      refuse();
      return {};
    }
    return text_.substr(begin, at_++ - begin);
  }
  void end() noexcept {
    skip_white();
    if (at_ != text_.size()) refuse();
  }

 private:
  void skip_white() noexcept {
    while (at_ < text_.size() && is_white(text_[at_])) ++at_;
  }
  /// A number as JSON writes it, limited to the forms that a build writes.
  template <class Number>
  Number plain_number() noexcept {
    skip_white();
    Number value{};
    if (!ok_) return value;
    const char* const begin = text_.data() + at_;
    const char* const last = text_.data() + text_.size();
    const auto [end, error] = std::from_chars(begin, last, value);
    const char* const digits = begin != last && *begin == '-' ? begin + 1 : begin;
    const bool leading_zero = end - digits > 1 && digits[0] == '0' && is_digit(digits[1]);
    if (error != std::errc() || !is_digit(*digits) || leading_zero || !is_digit(end[-1])) {
      refuse();
      return value;
    }
    at_ += static_cast<std::size_t>(end - begin);
    return value;
  }

  std::string_view text_;
  std::size_t at_ = 0;
  bool ok_ = true;
};

HalfOpenBox box(Scanner& scan) {
  HalfOpenBox result;
  scan.take("{");
  scan.key("\"min\"");
  result.min = scan.numbers<Eigen::Vector2d>();
  scan.next("\"max\"");
  result.max = scan.numbers<Eigen::Vector2d>();
  scan.take("}");
  return result;
}

Footprint footprint(Scanner& scan) {
  Footprint result;
  scan.take("{");
  if (scan.take_if("\"box\"")) {
    scan.take(":");
    result = box(scan);
  } else if (scan.take_if("\"boxes\"")) {
    scan.take(":");
    scan.take("[");
    BoxUnion shape;
    do {
      shape.boxes.push_back(box(scan));
    } while (scan.ok() && scan.more());
    result = std::move(shape);
  } else {
    scan.key("\"polygon\"");
    scan.take("[");
    ConvexPolygon shape;
    do {
      shape.corners.push_back(scan.numbers<Eigen::Vector2d>());
    } while (scan.ok() && scan.more());
    result = std::move(shape);
  }
  scan.take("}");
  return result;
}

Region region(Scanner& scan, TileInfo& tile) {
  constexpr auto kAny = std::numeric_limits<std::uint64_t>::max();
  Region result;
  scan.take("{");
  scan.key("\"label\"");
  result.label = scan.text();
  scan.next("\"file\"");
  if (scan.text() != tile_name(result)) scan.refuse();
  scan.next("\"footprint\"");
  result.footprint = footprint(scan);
  scan.next("\"height\"");
  const auto height = scan.numbers<Eigen::Vector2d>();
  result.height = {height[0], height[1]};
  scan.next("\"points\"");
  tile.points = scan.count(kMaxPoints);
  scan.next("\"viewpoints\"");
  tile.viewpoints = scan.count(kMaxPoints);
  scan.next("\"elements\"");
  tile.elements = scan.count(kAny);
  scan.next("\"prepared_bytes\"");
  tile.prepared_bytes = scan.count(kMaxPreparedBytes);
  if (tile.elements > 0 && tile.prepared_bytes == 0) scan.refuse();
  scan.take(",");
  if (scan.take_if("\"max_views\"")) {
    scan.take(":");
    tile.max_views =
        static_cast<std::uint32_t>(scan.count(std::numeric_limits<std::uint32_t>::max()));
    if (tile.max_views == 0 || tile.points == 0) scan.refuse();
    scan.take(",");
  }
  scan.key("\"bytes\"");
  tile.bytes = scan.count(kAny);
  scan.next("\"origin\"");
  tile.origin = scan.numbers<Point>();
  if (!scan.ok() || !tile.origin.allFinite() || tile.bytes != file_size(tile)) {
    scan.refuse();
  }
  scan.next("\"checksum\"");
  tile.checksum = scan.checksum();
  scan.take("}");
  return result;
}

/// The checksum of the text without the white space between its tokens, followed by the end of an
/// object.
std::uint64_t checksum_of(std::string_view text) noexcept {
  Checksum sum;
  bool in_string = false;
  for (std::size_t i = 0; i < text.size(); ++i) {
    const char c = text[i];
    if (in_string) {
      sum.add(c);
      if (c == '\\' && i + 1 < text.size()) sum.add(text[++i]);
      in_string = c != '"';
    } else if (!is_white(c)) {
      sum.add(c);
      in_string = c == '"';
    }
  }
  sum.add('}');
  return sum.value();
}

}  // namespace

std::optional<BundleIndex> read_as_written(std::string_view text) {
  Scanner scan(text);
  BundleIndex index;
  std::vector<Region> regions;
  scan.take("{");
  scan.key("\"format\"");
  if (scan.text() != kFormat) scan.refuse();
  scan.next("\"version\"");
  if (scan.count(kVersionWithViews) < kVersion) scan.refuse();
  scan.next("\"map\"");
  scan.take("{");
  scan.key("\"points\"");
  index.map.map_points = scan.count(std::numeric_limits<std::uint64_t>::max());
  scan.next("\"bounds\"");
  scan.take("{");
  scan.key("\"min\"");
  index.map.map_bounds.min = scan.numbers<Point>();
  scan.next("\"max\"");
  index.map.map_bounds.max = scan.numbers<Point>();
  scan.take("}");
  scan.take("}");
  scan.next("\"config\"");
  const std::string_view config = scan.quoted();
  scan.next("\"regions\"");
  scan.take("[");
  do {
    TileInfo tile;
    regions.push_back(region(scan, tile));
    index.tiles.push_back(tile);
    index.map.regions.push_back(tile.summary());
  } while (scan.ok() && scan.more());
  const std::size_t summed = scan.offset();
  scan.next("\"checksum\"");
  const std::uint64_t said = scan.checksum();
  scan.take("}");
  scan.end();
  if (!scan.ok() || said != checksum_of(text.substr(0, summed))) return std::nullopt;

  const auto unescaped =
      nlohmann::json::parse("\"" + std::string(config) + "\"", nullptr, /*allow_exceptions=*/false);
  if (!unescaped.is_string()) return std::nullopt;
  index.map.config = unescaped.get<std::string>();
  auto partition = Partition::from(std::move(regions));
  if (!partition) return std::nullopt;
  index.map.partition = *std::move(partition);
  return index;
}

}  // namespace vantage::pcd_tiles
