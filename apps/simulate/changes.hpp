#pragma once

#include <cstdint>

#include "simulate/campus.hpp"
#include "simulate/params.hpp"
#include "simulate/street_grid.hpp"
#include "simulate/terrain.hpp"
#include "vantage/result.hpp"

namespace vantage::simulation {

/// The campus on the day of the drive. Each kind of change has its own random numbers: another kind
/// alters nothing of it.
/// @param campus  on the day of the map
/// Errors: `invalid_config` if there are not so many buildings to take away, or if no place is left
/// for a new one or for a fence.
[[nodiscard]] Result<Campus> changed(const Campus& campus, const WorldParams& params,
                                     const StreetGrid& streets, const Terrain& terrain);

}  // namespace vantage::simulation
