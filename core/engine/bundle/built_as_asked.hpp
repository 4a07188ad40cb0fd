#pragma once

#include "vantage/engine/config.hpp"
#include "vantage/engine/plugin_loader.hpp"
#include "vantage/region_directory.hpp"
#include "vantage/result.hpp"

namespace vantage {

/// Whether a bundle was built as a configuration asks. What the configuration leaves out is not
/// asked for. Keys that do not change the bundle may differ: [matcher], [localizer], the place of
/// the bundle, and paths, because files move. A bundle that keeps no configuration is not judged.
/// Error: `invalid_config` that names the key and both values, at the place of the key.
[[nodiscard]] Result<void> check_built_as_asked(const Config& asked, const BundleSummary& bundle,
                                                const PluginLoader& plugins);

}  // namespace vantage
