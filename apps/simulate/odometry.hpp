#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "simulate/drive.hpp"
#include "simulate/params.hpp"
#include "simulate/world.hpp"
#include "vantage/io/trajectory_io.hpp"

namespace vantage::simulation {

/// T_map_sensor at these stamps of a drive [s].
[[nodiscard]] io::Trajectory truth_at(const World& world, const Drive& drive,
                                      std::span<const double> stamps);
/// T_map_sensor at the stamps of the scans of a drive.
[[nodiscard]] io::Trajectory reference_of(const World& world, const Drive& drive);

/// When odometry reports [s], see `odometry.rate`.
[[nodiscard]] std::vector<double> stamps_of_odometry(const Drive& drive,
                                                     const OdometryParams& params);

/// The drive as odometry feels it, without noise: odometry does not notice kidnaps.
/// @param truth  T_map_sensor at any stamps of the drive
/// @return       poses that differ from the truth by a rigid transform after each kidnap
[[nodiscard]] io::Trajectory without_kidnaps(const World& world, const Drive& drive,
                                             const io::Trajectory& truth);

/// Odometry that drifts: the motions between consecutive true poses, each with a random error whose
/// variance grows with the distance, joined together. Where the wheels slip, motions are too long
/// or too short by a factor.
/// @param truth  T_map_sensor, stamped
/// @return       T_odometry_sensor at the same stamps; the first pose is the identity
[[nodiscard]] io::Trajectory simulate_odometry(const io::Trajectory& truth,
                                               const OdometryParams& params, std::uint64_t seed);

}  // namespace vantage::simulation
