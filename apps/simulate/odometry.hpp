#pragma once

#include <cstdint>

#include "simulate/drive.hpp"
#include "simulate/params.hpp"
#include "simulate/world.hpp"
#include "vantage/io/trajectory_io.hpp"

namespace vantage::simulation {

/// T_map_sensor at the stamps of the scans of a drive.
[[nodiscard]] io::Trajectory reference_of(const World& world, const Drive& drive);

/// The drive as odometry feels it, without noise: odometry does not notice kidnaps.
/// @param reference  that of the drive
/// @return           poses that differ from the reference by a rigid transform after each kidnap
[[nodiscard]] io::Trajectory without_kidnaps(const World& world, const Drive& drive,
                                             const io::Trajectory& reference);

/// Odometry that drifts: the motions between consecutive true poses, each with a random error whose
/// variance grows with the distance, joined together.
/// @param truth  T_map_sensor, stamped
/// @return       T_odometry_sensor at the same stamps; the first pose is the identity
[[nodiscard]] io::Trajectory simulate_odometry(const io::Trajectory& truth,
                                               const OdometryParams& params, std::uint64_t seed);

}  // namespace vantage::simulation
