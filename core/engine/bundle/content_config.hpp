#pragma once

#include "vantage/api.hpp"
#include "vantage/engine/config.hpp"

namespace vantage {

/// The part of a configuration that decides what a bundle holds; a bundle keeps it. The place of
/// the bundle, the localizer, what it is connected to, the atlas, and all that the build does not
/// use are left out.
[[nodiscard]] VANTAGE_API Config content_config(const Config& config);

}  // namespace vantage
