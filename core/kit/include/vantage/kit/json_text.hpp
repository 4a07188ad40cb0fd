#pragma once

#include <cstddef>
#include <string>
#include <string_view>
#include <utility>

#include "vantage/error.hpp"
#include "vantage/result.hpp"

/// JSON that comes from outside, and JSON that goes there: files of bundles, runs and exports.
namespace vantage {

/// Levels of arrays and objects. The project's own files have seven. A value that is nested by the
/// hundred thousand can be parsed, but it cannot be copied or written: that takes a call for each
/// level.
inline constexpr std::size_t kDeepestJson = 64;

/// The largest number of brackets that are open at one place of a text, outside of its strings.
[[nodiscard]] std::size_t json_depth(std::string_view text) noexcept;

/// Line and column of a byte of a text, which counts from 1.
[[nodiscard]] SourceLocation place_in_text(std::string_view text, std::size_t byte,
                                           const std::string& file);

/// Reads a text whose every byte may be forged. Nothing else parses JSON from outside.
/// @tparam Json  nlohmann::json or nlohmann::ordered_json
/// @param what  begins the message: "the index is damaged or cut short"
/// Errors (`where` is the place in the file): `corrupt_data` for what is not JSON, or nested deeper
/// than kDeepestJson.
template <class Json>
[[nodiscard]] Result<Json> parse_json(std::string_view text, const std::string& file,
                                      const std::string& what) {
  const auto corrupt = [&](const std::string& reason, SourceLocation where) {
    return fail(ErrorCode::corrupt_data, what + ": " + reason, std::move(where));
  };
  if (json_depth(text) > kDeepestJson) {
    return corrupt("it is not JSON of at most " + std::to_string(kDeepestJson) + " levels",
                   {file, 0, 0});
  }
  try {
    return Json::parse(text);
  } catch (const typename Json::parse_error& e) {
    return corrupt("it is not JSON", place_in_text(text, e.byte, file));
  } catch (const typename Json::exception& e) {  // a number that is too large
    return corrupt(e.what(), {file, 0, 0});
  }
}

/// JSON in one line, whatever bytes are in its texts: what is not UTF-8 becomes U+FFFD. Paths may
/// have any bytes.
/// @tparam Json  nlohmann::json or nlohmann::ordered_json
template <class Json>
[[nodiscard]] std::string json_line(const Json& json) {
  return json.dump(-1, ' ', false, Json::error_handler_t::replace);
}

/// As json_line, for people: in lines, with one at the end.
template <class Json>
[[nodiscard]] std::string json_text(const Json& json) {
  return json.dump(2, ' ', false, Json::error_handler_t::replace) + '\n';
}

}  // namespace vantage
