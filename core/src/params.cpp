#include "vantage/params.hpp"

#include <sstream>

namespace vantage {
namespace {

std::string joined(const std::vector<std::string>& words) {
  std::string text;
  for (const std::string& word : words) text += (text.empty() ? "'" : ", '") + word + "'";
  return text;
}

std::string number(double x) {
  std::ostringstream out;
  out << x;
  return out.str();
}

}  // namespace

std::string Range::to_string() const {
  const bool below = std::isfinite(max);
  const bool above = std::isfinite(min);
  if (above && below) {
    return std::string("in ") + (min_open ? "(" : "[") + number(min) + ", " + number(max) +
           (max_open ? ")" : "]");
  }
  if (above) return (min_open ? "> " : ">= ") + number(min);
  if (below) return (max_open ? "< " : "<= ") + number(max);
  return "";
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
  std::string allowed = range.to_string();
  if (allowed.empty()) allowed = "finite";
  return fail(ErrorCode::invalid_config,
              "'" + std::string(key) + "' must be " + allowed +
                  (unit.empty() ? "" : " " + std::string(unit)) + ", not " + to_toml(value),
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

Result<void> only_known_keys(const Table& table, const std::vector<std::string>& known) {
  for (const Entry& entry : table.entries) {
    if (std::find(known.begin(), known.end(), entry.key) != known.end()) continue;
    std::string hint = did_you_mean(entry.key, known);
    if (hint.empty()) hint = known.empty() ? "; no key is known here" : "; known: " + joined(known);
    return fail(ErrorCode::invalid_config, "unknown key '" + entry.key + "'" + hint, entry.where);
  }
  return {};
}

std::filesystem::path resolve_path(const std::string& text, const SourceLocation& where) {
  const std::filesystem::path path(text);
  if (path.is_absolute() || path.empty()) return path;
  if (where.file.empty() || where.line == 0) return path;  // the command line: from the cwd
  return (std::filesystem::path(where.file).parent_path() / path).lexically_normal();
}

}  // namespace detail
}  // namespace vantage
