#pragma once

#include <cstdint>

#include "simulate/params.hpp"
#include "vantage/io/trajectory_io.hpp"

namespace vantage::simulation {

/// Odometry that drifts: each motion between two poses of the truth with a random error whose
/// variance grows with the distance, all joined up.
/// @param truth  T_map_sensor, stamped
/// @return       T_odometry_sensor at the same stamps; the first one is the identity
[[nodiscard]] io::Trajectory simulate_odometry(const io::Trajectory& truth,
                                               const OdometryParams& params, std::uint64_t seed);

}  // namespace vantage::simulation
