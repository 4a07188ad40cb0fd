#pragma once

#include <cstddef>
#include <vector>

#include "vantage/pose.hpp"

namespace vantage::benchmarks {

/// How far a start is off, whatever the direction.
struct Off {
  double metres = 0.0, degrees = 0.0;
};

/// Poses off a reference: moved by `off.metres` in the plane, evenly round from where the sensor
/// faces, and turned by `off.degrees` about the map's z axis through the sensor, to the left and to
/// the right in turn.
/// @param directions  even; how many if the start is moved. Only turned there are two, not off one.
[[nodiscard]] std::vector<Pose> starts(const Pose& T_map_scan, const Off& off,
                                       std::size_t directions);

}  // namespace vantage::benchmarks
