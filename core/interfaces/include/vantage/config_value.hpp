#pragma once

#include <cstdint>
#include <string>
#include <string_view>
#include <variant>
#include <vector>

#include "vantage/api.hpp"
#include "vantage/error.hpp"

namespace vantage {

struct Value;
struct Entry;
using Array = std::vector<Value>;

/// A configuration table that remembers where it was written, so that a plugin can point at the
/// line of a wrong parameter. Entries keep the order of the file.
struct Table {
  std::vector<Entry> entries;
  SourceLocation where;

  [[nodiscard]] VANTAGE_API const Value* find(std::string_view key) const noexcept;
};

struct Value {
  std::variant<bool, std::int64_t, double, std::string, Array, Table> data;
  SourceLocation where;
};

struct Entry {
  std::string key;
  Value value;
  SourceLocation where;  ///< of the key
};

/// "a boolean", "an integer", "a number", "a string", "an array", "a table".
[[nodiscard]] VANTAGE_API const char* type_name(const Value& value) noexcept;

/// Suggests what a misspelt word was meant to be: "; did you mean 'x'?" for the nearest candidate,
/// "'x' or 'y'" for candidates that are equally near, "" if none is near. Upper and lower case
/// count as the same letter.
/// @param written  words that are in the text already; among equally near candidates, these are not
///                 suggested
[[nodiscard]] VANTAGE_API std::string did_you_mean(std::string_view word,
                                                   const std::vector<std::string>& candidates,
                                                   const std::vector<std::string>& written = {});

}  // namespace vantage
