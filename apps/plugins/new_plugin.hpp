#pragma once

#include <filesystem>
#include <string>

#include "vantage/engine/plugin_loader.hpp"
#include "vantage/result.hpp"

namespace vantage {

/// Writes a separate project for a new plugin: source, CMake, parameters, test and README. The
/// project builds against an installed Vantage and keeps the contract of its kind without changes.
/// @param name    snake_case; the name of the plugin and of its files
/// @param folder  must not exist, or must be empty; appears completely or not at all
/// Errors: `invalid_input` for an invalid name, `already_exists`, `io_failure`.
[[nodiscard]] Result<void> write_plugin_project(PluginKind kind, const std::string& name,
                                                const std::filesystem::path& folder);

/// The names of all kinds, in one line.
[[nodiscard]] std::string plugin_kinds(const std::string& between);

/// Errors: `invalid_input` for a word that is not a kind.
[[nodiscard]] Result<PluginKind> plugin_kind(const std::string& word);

}  // namespace vantage
