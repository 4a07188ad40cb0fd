#pragma once

#include "localize/evidence.hpp"
#include "vantage/engine/atlas.hpp"
#include "vantage/engine/bundle.hpp"
#include "vantage/engine/plugin_loader.hpp"
#include "vantage/result.hpp"

namespace vantage {

/// The model of a calibration's shares. It begins at the default model, which counts as some
/// thousands of samples: a few samples change little. A map with many alike places makes a wrong
/// pose more likely to fit. Right poses may be less sharp than by default, but no more is expected
/// of them: virtual scans do not know what changes in the world.
[[nodiscard]] ShareModel fitted_model(const Calibration& calibration);

/// The model for a matcher in a bundle: that of its calibration if it is for this matcher with
/// these parameters, otherwise the default model. Errors: those of Atlas::of_bundle and
/// MatcherChoice::of.
[[nodiscard]] Result<ShareModel> share_model_of(const Bundle& bundle, const PluginChoice& matcher,
                                                const PluginLoader& plugins);

}  // namespace vantage
