#pragma once

#include <cstdint>
#include <span>
#include <string>
#include <vector>

#include "simulate/drive.hpp"
#include "simulate/params.hpp"
#include "vantage/track/samples.hpp"

namespace vantage::simulation {

inline constexpr double kGravity = 9.80665;  ///< [m/s^2], along -z of the map

/// What an IMU on the sensor measures on a drive, from the first scan to after the last sweep. A
/// drive that starts still is measured from one second before the first scan on. The IMU feels no
/// kidnap.
///
/// A rate is the mean over one sampling interval around its stamp. An acceleration is the second
/// difference of positions, which is a mean with the weights of a triangle: it reaches 20 ms, or
/// one sampling interval if that is longer, to each side. (A drive consists of short straight
/// pieces, so its true acceleration is a series of jolts.) Without noise and bias, integration of
/// the samples thus gives the poses of the drive again.
/// @param params  with a rate
/// @return        stamps on the IMU's clock; accelerations in m/s^2, whatever the unit
[[nodiscard]] std::vector<ImuSample> simulate_imu(const Drive& drive, const ImuParams& params,
                                                  std::uint64_t seed);

/// The text of imu.csv: `t,wx,wy,wz,ax,ay,az` [s, rad/s, the unit].
[[nodiscard]] std::string to_csv(std::span<const ImuSample> samples, AccelerationUnit unit);

}  // namespace vantage::simulation
