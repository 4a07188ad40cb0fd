#pragma once

#include <cstdint>
#include <optional>

#include "localize/hypothesis.hpp"
#include "places/place_search.hpp"
#include "vantage/engine/localizer_params.hpp"
#include "vantage/pose_prior.hpp"

namespace vantage {

/// Where to search for a sensor whose pose is in doubt: around an absolute prior, otherwise around
/// the prediction, in a circle that grows from scan to scan, otherwise everywhere.
/// @param predicted   of the best hypothesis; none if the sensor may be anywhere
/// @param scans       in a row with such doubts, 1 or more
/// @param everywhere  without a prior, the circle is the widest at once
/// @return            nothing if this scan does not search
[[nodiscard]] std::optional<PlaceArea> search_area(const std::optional<PosePrior>& prior,
                                                   const std::optional<Pose>& predicted,
                                                   const Bounds3& map, std::uint32_t scans,
                                                   bool everywhere, const LocalizerParams& params);

}  // namespace vantage
