#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <optional>
#include <vector>

#include "simulate/params.hpp"
#include "simulate/world.hpp"

namespace vantage::simulation {

/// People who walk with the sensor: upright cylinders, 1 to 5 m away, that sway around their
/// places. A sensor that drives on has them always beside it, and the map has none of them.
class Crowd {
 public:
  Crowd(const LidarParams& params, std::uint64_t seed);

  /// What a ray meets: a person before the surface, or the surface.
  /// @param direction  of the ray, campus frame, unit
  /// @param seconds    of the drive
  [[nodiscard]] std::optional<Hit> before(const std::optional<Hit>& surface,
                                          const Eigen::Vector3d& direction, double seconds) const;

 private:
  struct Person {
    double azimuth, distance;  // [rad, m]
    double phase, frequency;   // of the swaying [rad, rad/s]
  };
  std::vector<Person> people_;
  double height_;  // of the sensor above the ground [m]
};

}  // namespace vantage::simulation
