#pragma once

#include <Eigen/Core>
#include <array>
#include <cstdint>

#include "simulate/params.hpp"
#include "vantage/pose.hpp"

namespace vantage::simulation {

/// Rough ground under the wheels of a vehicle: each track is the mean of two sine waves along the
/// way, of lengths `roughness_length` and 1.618 times that, so it does not repeat. The vehicle
/// stands on four wheels, 1.2 m apart along the way and 1 m across it.
class Roughness {
 public:
  Roughness(const DriveParams& params, std::uint64_t seed);

  [[nodiscard]] bool is_none() const noexcept { return amplitude_ == 0.0; }
  /// The height of the left (0) or right (1) track above the smooth ground [m].
  [[nodiscard]] double height(std::size_t track, double distance) const noexcept;
  /// How the vehicle stands on its wheels there: T_smooth_rough. Frames on the ground below the
  /// middle of the vehicle, x forward, y left, z up.
  [[nodiscard]] Pose stand(double distance) const noexcept;

 private:
  double amplitude_, length_;                      // [m]
  std::array<std::array<double, 2>, 2> phases_{};  // of the waves of each track [rad]
};

}  // namespace vantage::simulation
