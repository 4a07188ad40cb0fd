#pragma once

#include "vantage/api.hpp"
#include "vantage/engine/bundle.hpp"
#include "vantage/engine/config.hpp"
#include "vantage/engine/plugin_loader.hpp"
#include "vantage/relocalizer.hpp"
#include "vantage/result.hpp"

namespace vantage {

/// A relocalizer that searches a bundle. None: the bundle is not searched.
struct BundleRelocalizer {
  PluginPtr<Relocalizer> plugin;
  bool reads_index = true;  ///< false: the bundle's index is that of another one
};

/// Loads the relocalizer of a configuration, or the one that made the bundle's index if the
/// configuration names none, and finds out whether it can read the index.
/// Errors: those of PluginLoader::load and of the store; `invalid_config` for a relocalizer that
/// cannot, if the bundle holds no points to make another index from.
[[nodiscard]] VANTAGE_API Result<BundleRelocalizer> relocalizer_for(const Bundle& bundle,
                                                                    const Config& config,
                                                                    const PluginLoader& plugins);

/// Opens the index that a bundle keeps. If the relocalizer can read none there, it makes one from
/// the bundle's points.
/// @return  none for a bundle that cannot be searched: with neither an index nor points, without a
///          relocalizer, or too large for it
/// Errors: those of the store and of the relocalizer.
[[nodiscard]] VANTAGE_API Result<PluginPtr<RelocalizerIndex>> open_index(
    const Bundle& bundle, const BundleRelocalizer& relocalizer);

}  // namespace vantage
