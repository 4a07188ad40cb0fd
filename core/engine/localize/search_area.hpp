#pragma once

#include <cstdint>
#include <optional>

#include "localize/hypothesis.hpp"
#include "vantage/engine/localizer_params.hpp"
#include "vantage/pose_prior.hpp"
#include "vantage/relocalizer.hpp"

namespace vantage {

/// Where to search for a sensor whose pose is in doubt. The search goes around the absolute prior
/// if there is one, and twice as far after every 16 scans, because the prior may be wrong.
/// Otherwise it goes around the prediction, in a circle that grows from scan to scan; the widest at
/// once if the map lies beyond it. Without a prediction either, it goes everywhere.
/// @param predicted   prediction of the best hypothesis; none if the sensor may be anywhere
/// @param scans       number of doubtful scans in a row, this one included
/// @param everywhere  without a prior, the circle is the widest at once
/// @return            nothing if this scan is not searched with
[[nodiscard]] std::optional<PlaceArea> search_area(const std::optional<PosePrior>& prior,
                                                   const std::optional<Pose>& predicted,
                                                   const Bounds3& map, std::uint32_t scans,
                                                   bool everywhere, const LocalizerParams& params);

}  // namespace vantage
