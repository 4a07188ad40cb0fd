#pragma once

#include "vantage/api.hpp"
#include "vantage/engine/bundle.hpp"
#include "vantage/engine/config.hpp"
#include "vantage/engine/plugin_loader.hpp"
#include "vantage/region_directory.hpp"
#include "vantage/result.hpp"
#include "vantage/scan_matcher.hpp"

namespace vantage {

/// Whether a bundle was built as a configuration asks. What the configuration leaves out is not
/// asked for. Keys that do not change the bundle may differ: [matcher], [localizer], the place of
/// the bundle, and paths, because files move. A bundle that keeps no configuration is not judged.
/// Error: `invalid_config` that names the key and both values, at the place of the key.
[[nodiscard]] Result<void> check_built_as_asked(const Config& asked, const BundleSummary& bundle,
                                                const PluginLoader& plugins);

/// Whether a matcher can use the prepared maps of a bundle: it restores the first of them. A bundle
/// of points is for every matcher, and a damaged map is told where it is needed.
/// Error: `invalid_config` that names the matcher that the bundle was built with.
[[nodiscard]] VANTAGE_API Result<void> check_prepared_for(const Bundle& bundle,
                                                          const ScanMatcher& matcher);

}  // namespace vantage
