#pragma once

#include <cstdint>

#include "simulate/params.hpp"
#include "vantage/io/trajectory_io.hpp"

namespace vantage::simulation {

/// Odometry that drifts: the motions between consecutive true poses, each with a random error whose
/// variance grows with the distance, joined together.
/// @param truth  T_map_sensor, stamped
/// @return       T_odometry_sensor at the same stamps; the first pose is the identity
[[nodiscard]] io::Trajectory simulate_odometry(const io::Trajectory& truth,
                                               const OdometryParams& params, std::uint64_t seed);

}  // namespace vantage::simulation
