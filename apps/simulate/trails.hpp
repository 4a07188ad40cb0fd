#pragma once

#include <cstdint>

#include "simulate/world.hpp"
#include "vantage/point_cloud.hpp"

namespace vantage::simulation {

/// What a passing vehicle leaves in a map that nobody has cleaned: a part of its surface, seen
/// again at another place in every sweep of a sensor (10 Hz). The vehicle drives up to 60 m along
/// one of the routes, in either lane, at 5 to 12 m/s.
/// @param point_spacing  a sweep would have one point per point_spacing^2 of surface if it saw all
///                       of the surface [m]
/// @return               points in the map frame [m]
[[nodiscard]] PointCloud trail_of_vehicle(const World& world, double point_spacing,
                                          std::uint64_t seed);

}  // namespace vantage::simulation
