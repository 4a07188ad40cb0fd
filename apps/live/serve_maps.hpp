#pragma once

#include <functional>

#include "live/live_params.hpp"
#include "live/notices.hpp"
#include "vantage/engine/bundle.hpp"
#include "vantage/result.hpp"

namespace vantage {

/// Publishes the map of the region that another localizer is in (see MapServer), until it is over.
/// Errors: `unsupported` for a bundle without points; those of Participant.
[[nodiscard]] Result<void> serve_maps(const live::LiveParams& params, const Bundle& bundle,
                                      double switch_margin, live::Notices& notices,
                                      const std::function<bool()>& is_over);

}  // namespace vantage
