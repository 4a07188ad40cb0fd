#pragma once

#include <filesystem>
#include <string>
#include <string_view>
#include <vector>

#include "vantage/api.hpp"
#include "vantage/config_value.hpp"
#include "vantage/result.hpp"

namespace vantage {

/// Parses TOML.
/// @param name  the text's name in error messages, for example the path of a file
/// Errors: `invalid_config` with the place of a syntax error, a duplicate key or a date.
[[nodiscard]] VANTAGE_API Result<Table> parse_toml(std::string_view text, const std::string& name);

/// Applies `key.path=value` overrides. A value that is not TOML counts as a string; relative paths
/// in a value start at the current directory. Errors: `invalid_config`.
[[nodiscard]] VANTAGE_API Result<Table> with_overrides(Table table,
                                                       const std::vector<std::string>& overrides);

/// Reads a TOML file and applies overrides.
/// Errors: `not_found`, `io_failure`, `invalid_config`.
[[nodiscard]] VANTAGE_API Result<Table> load_toml(const std::filesystem::path& file,
                                                  const std::vector<std::string>& overrides = {});

/// Writes TOML, which `parse_toml` reads as the same values. `to_toml(Table)` writes nested tables
/// as [sections], with `prefix` before their names.
[[nodiscard]] VANTAGE_API std::string to_toml(const Value& value);
[[nodiscard]] VANTAGE_API std::string to_toml(const Table& table, const std::string& prefix = {});

}  // namespace vantage
