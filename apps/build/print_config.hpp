#pragma once

#include <string>

#include "vantage/engine/config.hpp"

namespace vantage {

/// The configuration as it counts, as TOML that loads again: the defaults of core and of the
/// plugins filled in, and for a key that has none and is left out, a comment on what that means.
/// Errors: a plugin that cannot be loaded or refuses its params.
[[nodiscard]] Result<std::string> printed_config(Config config, const PluginLoader& loader);

}  // namespace vantage
