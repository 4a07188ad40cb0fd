#include "vantage/params.hpp"

#include <algorithm>
#include <charconv>

namespace vantage {
namespace {

std::string joined(const std::vector<std::string>& words) {
  std::string text;
  for (const std::string& word : words) text += (text.empty() ? "'" : ", '") + word + "'";
  return text;
}

std::string number(double x) {
  char text[32];
  return std::string(text, std::to_chars(text, text + sizeof text, x).ptr);
}

/// A number as TOML has it, which tells 1.0 from 1.
std::string number(const Value& value) {
  if (const auto* whole = std::get_if<std::int64_t>(&value.data)) return std::to_string(*whole);
  const double x = std::get<double>(value.data);
  if (std::isnan(x)) return "nan";
  const std::string text = number(x);
  return text.find_first_of(".ei") == std::string::npos ? text + ".0" : text;
}

const Value* find_path(const Table& table, std::string_view path) {
  const std::size_t dot = path.find('.');
  const Value* value = table.find(path.substr(0, dot));
  if (value == nullptr || dot == std::string_view::npos) return value;
  const auto* inside = std::get_if<Table>(&value->data);
  return inside == nullptr ? nullptr : find_path(*inside, path.substr(dot + 1));
}

}  // namespace

std::string Range::to_string() const {
  const bool below = std::isfinite(max);
  const bool above = std::isfinite(min);
  if (above && below && min == max) return number(min);
  if (above && below) {
    return std::string("in ") + (min_open ? "(" : "[") + number(min) + ", " + number(max) +
           (max_open ? ")" : "]");
  }
  if (above) return (min_open ? "> " : ">= ") + number(min);
  if (below) return (max_open ? "< " : "<= ") + number(max);
  return "";
}

tl::unexpected<Error> fail_at(std::initializer_list<std::string_view> keys, std::string message) {
  Error error{.code = ErrorCode::invalid_config,
              .message = std::move(message),
              .where = {},
              .context = {},
              .keys = {}};
  for (const std::string_view key : keys) error.keys.emplace_back(key);
  return fail(std::move(error));
}

namespace detail {

tl::unexpected<Error> wrong_type(const Value& value, std::string_view key,
                                 std::string_view expected) {
  return fail(
      ErrorCode::invalid_config,
      "'" + std::string(key) + "' must be " + std::string(expected) + ", not " + type_name(value),
      value.where);
}

tl::unexpected<Error> out_of_range(const Value& value, std::string_view key, const Range& range,
                                   std::string_view unit) {
  const auto* real = std::get_if<double>(&value.data);
  const bool finite = real == nullptr || std::isfinite(*real);
  std::string allowed = range.to_string();
  if (!allowed.empty() && !unit.empty()) allowed += " " + std::string(unit);
  if (!finite) allowed = allowed.empty() ? "finite" : "finite and " + allowed;
  return fail(ErrorCode::invalid_config,
              "'" + std::string(key) + "' must be " + allowed + ", not " + number(value),
              value.where);
}

tl::unexpected<Error> wrong_choice(const Value& value, std::string_view key,
                                   const std::vector<std::string>& choices) {
  const auto& text = std::get<std::string>(value.data);
  return fail(ErrorCode::invalid_config,
              "'" + std::string(key) + "' must be one of " + joined(choices) + ", not '" + text +
                  "'" + did_you_mean(text, choices),
              value.where);
}

tl::unexpected<Error> missing_key(const Table& table, std::string_view key, std::string_view doc) {
  return fail(ErrorCode::invalid_config,
              "missing key '" + std::string(key) + "' (" + std::string(doc) + ")", table.where);
}

tl::unexpected<Error> wrong_length(const Value& value, std::string_view key,
                                   std::string_view expected, std::size_t length) {
  return fail(ErrorCode::invalid_config,
              "'" + std::string(key) + "' must be " + std::string(expected) + ", not of " +
                  std::to_string(length),
              value.where);
}

Error at_keys(Error error, const Table& table) {
  const std::vector<std::string> keys = std::exchange(error.keys, {});
  if (error.where) return error;
  error.where = table.where;
  for (const std::string& key : keys) {
    const Value* value = find_path(table, key);
    if (value == nullptr) continue;
    error.where = value->where;
    break;
  }
  return error;
}

std::string type_text(ValueKind kind, bool array, std::optional<std::size_t> length) {
  constexpr std::array kNames{"boolean", "integer", "number", "string", "path", "choice", "table"};
  std::string name = kNames.at(static_cast<std::size_t>(kind));
  if (!array) return name;
  return "array of " + (length ? std::to_string(*length) + " " : "") + name + "s";
}

std::string element_key(std::string_view key, std::size_t index) {
  return std::string(key) + "[" + std::to_string(index) + "]";
}

Result<void> only_known_keys(const Table& table, const std::vector<std::string>& known) {
  std::vector<std::string> written;
  for (const Entry& entry : table.entries) written.push_back(entry.key);
  for (const Entry& entry : table.entries) {
    if (std::find(known.begin(), known.end(), entry.key) != known.end()) continue;
    std::string hint = did_you_mean(entry.key, known, written);
    if (hint.empty())
      hint = known.empty() ? "; no keys are allowed here" : "; known: " + joined(known);
    return fail(ErrorCode::invalid_config, "unknown key '" + entry.key + "'" + hint, entry.where);
  }
  return {};
}

std::filesystem::path resolve_path(const std::string& text, const SourceLocation& where) {
  std::filesystem::path path(text);
  if (path.is_absolute() || path.empty()) return path;
  if (where.file.empty()) return path;
  if (where.line == 0) return std::filesystem::absolute(path).lexically_normal();  // --set
  return (std::filesystem::path(where.file).parent_path() / path).lexically_normal();
}

}  // namespace detail
}  // namespace vantage
