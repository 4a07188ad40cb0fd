#pragma once

#include <cstdint>

#include "simulate/world.hpp"
#include "vantage/point_cloud.hpp"

namespace vantage::simulation {

/// What a vehicle that drives past leaves in a map that nobody cleaned: a part of its surface,
/// seen again in every sweep of a sensor (10 Hz) from another place. It drives up to 60 m along one
/// of the routes, in either lane, at 5 to 12 m/s.
/// @param point_spacing  one point per point_spacing^2 of surface in a sweep, were all of it seen
///                       [m]
/// @return               points in the map frame [m]
[[nodiscard]] PointCloud trail_of_vehicle(const World& world, double point_spacing,
                                          std::uint64_t seed);

}  // namespace vantage::simulation
