#pragma once

#include <string>

#include "vantage/engine/config.hpp"

namespace vantage {

/// The effective configuration as TOML that can be loaded again. The defaults of the engine and of
/// the plugins are filled in. A key that is left out and has no default gets a comment that says
/// what leaving it out means.
/// Errors: a plugin that cannot be loaded or that refuses its params.
[[nodiscard]] Result<std::string> printed_config(Config config, const PluginLoader& loader);

}  // namespace vantage
