#pragma once

#include <string>
#include <vector>

#include "vantage/engine/plugin_loader.hpp"

namespace vantage::documentation {

/// "> 0", "in [0, 1]", an enum's "map, region", or "" if everything is allowed. A bound that
/// follows only from the size of an integer is left out.
[[nodiscard]] std::string allowed_values(const ParameterDoc& parameter);
/// "Eq. 2; Yagi et al. 2026, Sec. 2.1"; "" if there is no source.
[[nodiscard]] std::string source_of(const ParameterDoc& parameter);

/// A plugin and its parameters for a person.
[[nodiscard]] std::string description(const PluginInfo& plugin);

/// The keys that a section of a configuration needs besides the plugin's name: lines of TOML, to
/// start from; empty for most kinds.
[[nodiscard]] std::string keys_of_section(PluginKind kind);

/// A section of a configuration file to start from. Defaults are written as comments. A required
/// value has a wrong type, so that a program refuses it, with its place, until the user fills it
/// in.
[[nodiscard]] std::string toml_template(const PluginInfo& plugin);

/// Markdown: the tables of a configuration file, then the plugins in the given order.
[[nodiscard]] std::string reference(const std::vector<ParameterDoc>& config,
                                    const std::vector<PluginInfo>& plugins);

}  // namespace vantage::documentation
