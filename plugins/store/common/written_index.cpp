#include "common/written_index.hpp"

#include <algorithm>
#include <charconv>
#include <cmath>
#include <limits>
#include <nlohmann/json.hpp>
#include <tuple>
#include <utility>

#include "common/index_format.hpp"
#include "vantage/kit/checksum.hpp"
#include "vantage/kit/json_text.hpp"

namespace vantage::bundle_folder {
namespace {

bool is_white(char c) noexcept { return c == ' ' || c == '\n' || c == '\t' || c == '\r'; }
bool is_digit(char c) noexcept { return c >= '0' && c <= '9'; }

/// The reader of what a build wrote: an Archive that takes what is expected, in order. After the
/// first surprise all of it fails.
class Scanner {
 public:
  explicit Scanner(std::string_view text) noexcept : text_(text) {}

  [[nodiscard]] bool ok() const noexcept { return ok_; }
  [[nodiscard]] std::size_t offset() const noexcept { return at_; }

  template <class Visit>
  void member(const char* key, const Visit& visit) {
    if (!std::exchange(is_first_, false)) take(",");
    if (!take_key(key)) ok_ = false;
    if (ok_) visit();
  }
  template <class Visit>
  bool member_if(const char* key, bool /*is_there*/, const Visit& visit) {
    if (!ok_) return true;
    const auto before = std::pair(at_, is_first_);
    if (!std::exchange(is_first_, false)) take(",");
    if (ok_ && take_key(key)) {
      visit();
      return true;
    }
    std::tie(at_, is_first_) = before;
    return false;
  }
  template <class Visit>
  void object(const Visit& visit) {
    take("{");
    is_first_ = true;
    visit();
    is_first_ = false;
    take("}");
  }
  template <class Element, class Visit>
  void list(std::vector<Element>& elements, const Visit& visit) {
    take("[");
    do {
      visit(elements.emplace_back());
    } while (ok_ && take_if(","));
    take("]");
  }
  template <class Vector>
  void numbers(Vector& v) noexcept {
    take("[");
    for (Eigen::Index i = 0; i < v.size(); ++i) {
      if (i > 0) take(",");
      v[i] = number();
    }
    take("]");
  }
  void count(std::uint64_t& value, std::uint64_t max) noexcept {
    value = plain_number<std::uint64_t>();
    if (value > max) ok_ = false;
  }
  void version(const BundleFormat& format, bool /*with_views*/) noexcept {
    const auto value = plain_number<std::uint64_t>();
    if (!format.knows(value)) ok_ = false;
  }
  void checksum(std::uint64_t& value) noexcept {
    const std::string_view digits = quoted();
    const char* const last = digits.data() + digits.size();
    const auto [end, error] = std::from_chars(digits.data(), last, value, 16);
    if (error != std::errc() || end != last || digits.size() != 16) ok_ = false;
  }
  void text(std::string& text) {
    const std::string_view inside = quoted();
    if (!ok_) return;
    const auto is_plain = [](char c) { return c >= ' ' && c <= '~' && c != '\\'; };
    if (std::all_of(inside.begin(), inside.end(), is_plain)) {
      text = inside;
      return;
    }
    const auto value = parse_json<nlohmann::json>("\"" + std::string(inside) + "\"", "", "");
    if (!value || !value->is_string()) {
      ok_ = false;
    } else {
      text = value->get<std::string>();
    }
  }
  template <class Reason>
  void check(bool ok, const char* /*key*/, const Reason& /*reason*/) noexcept {
    ok_ = ok_ && ok;
  }
  /// After the last member.
  void end() noexcept {
    take("}");
    skip_white();
    if (at_ != text_.size()) ok_ = false;
  }
  void begin() noexcept {
    take("{");
    is_first_ = true;
  }

 private:
  /// Whether the next token is this one; takes it if so.
  bool take_if(std::string_view token) noexcept {
    skip_white();
    if (!ok_ || !text_.substr(at_).starts_with(token)) return false;
    at_ += token.size();
    return true;
  }
  void take(std::string_view token) noexcept {
    if (!take_if(token)) ok_ = false;
  }
  /// Takes a key and its colon if they are next.
  bool take_key(std::string_view key) noexcept {
    skip_white();
    const std::string_view rest = text_.substr(std::min(at_, text_.size()));
    if (!rest.starts_with('"') || !rest.substr(1).starts_with(key) ||
        !rest.substr(1 + key.size()).starts_with('"')) {
      return false;
    }
    at_ += key.size() + 2;
    take(":");
    return true;
  }

  double number() noexcept {
    if (take_if("\"inf\"")) return kInfinity;
    if (take_if("\"-inf\"")) return -kInfinity;
    return plain_number<double>();
  }
  /// What is between the quotes of a string, escapes as they are.
  std::string_view quoted() noexcept {
    take("\"");
    const std::size_t begin = at_;
    while (ok_ && at_ < text_.size() && text_[at_] != '"') at_ += text_[at_] == '\\' ? 2 : 1;
    if (!ok_ || at_ >= text_.size()) {
      ok_ = false;
      return {};
    }
    return text_.substr(begin, at_++ - begin);
  }
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
      ok_ = false;
      return value;
    }
    at_ += static_cast<std::size_t>(end - begin);
    return value;
  }

  std::string_view text_;
  std::size_t at_ = 0;
  bool ok_ = true;
  bool is_first_ = true;  // of its object's members
};

/// Of the text without the white space between its tokens, and an object's end behind it.
std::uint64_t checksum_of(std::string_view text) noexcept {
  Fnv1a sum;
  const auto add = [&](char c) { sum.add(static_cast<unsigned char>(c)); };
  bool in_string = false;
  for (std::size_t i = 0; i < text.size(); ++i) {
    const char c = text[i];
    if (in_string) {
      add(c);
      if (c == '\\' && i + 1 < text.size()) add(text[++i]);
      in_string = c != '"';
    } else if (!is_white(c)) {
      add(c);
      in_string = c == '"';
    }
  }
  add('}');
  return sum.value();
}

}  // namespace

std::optional<BundleIndex> read_as_written(const BundleFormat& format, std::string_view text) {
  Scanner scan(text);
  IndexContent content;
  scan.begin();
  describe(scan, format, content);
  const std::size_t summed = scan.offset();
  std::uint64_t said = 0;
  scan.member(kChecksum, [&] { scan.checksum(said); });
  scan.end();
  if (!scan.ok() || said != checksum_of(text.substr(0, summed))) return std::nullopt;
  auto index = bundle_of(std::move(content));
  if (!index) return std::nullopt;
  index->generation = said;
  return *std::move(index);
}

}  // namespace vantage::bundle_folder
