#pragma once

#include <functional>
#include <vector>

#include "build/atlas/sites.hpp"
#include "build/atlas/virtual_lidar.hpp"
#include "vantage/engine/atlas.hpp"
#include "vantage/engine/bundle.hpp"
#include "vantage/engine/plugin_loader.hpp"
#include "vantage/relocalizer.hpp"
#include "vantage/result.hpp"
#include "vantage/scan_matcher.hpp"

namespace vantage {

/// Measures an atlas: virtual scans of the sites are aligned with the regions' maps, from right and
/// from wrong starts. The atlas does not depend on the number of threads.
/// @param sites   in the order of their regions
/// @param places  where places from which the scans may seem to come are searched for; none: no
///                wrong starts
/// @param step    called after the scans of each site are made and again after the trials from
///                around it, from any thread
/// @return        without the name of the matcher
/// Errors: those of `hits_at`, of the bundle, and of the matcher, except `too_few_matches`.
[[nodiscard]] Result<Atlas> try_sites(const Bundle& bundle, const std::vector<SitePlace>& sites,
                                      const HitsAt& hits_at, const RelocalizerIndex* places,
                                      const PluginPtr<ScanMatcher>& matcher,
                                      const std::function<void()>& step);

}  // namespace vantage
