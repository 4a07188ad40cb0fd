#pragma once

#include <filesystem>
#include <string>

#include "vantage/engine/plugin_loader.hpp"
#include "vantage/result.hpp"

namespace vantage {

/// Writes a project of its own for a new plugin: source, CMake, parameters, test and README. It
/// builds against an installed Vantage and keeps the contract of its kind as it is.
/// @param name    snake_case; the plugin's name and that of its files
/// @param folder  must not exist, or be empty; appears whole or not at all
/// Errors: `invalid_input` for a name that is none, `already_exists`, `io_failure`.
[[nodiscard]] Result<void> write_plugin_project(PluginKind kind, const std::string& name,
                                                const std::filesystem::path& folder);

/// Errors: `invalid_input` for a word that is no kind.
[[nodiscard]] Result<PluginKind> plugin_kind(const std::string& word);

}  // namespace vantage
