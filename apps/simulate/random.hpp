#pragma once

#include <Eigen/Core>
#include <cmath>
#include <cstdint>
#include <numbers>

#include "vantage/kit/hash.hpp"

namespace vantage::simulation {

/// What a seed is used for; each use has its own numbers.
enum class Purpose : std::uint64_t {
  terrain,
  streets,
  block,
  map_point,
  ray,
  odometry,
  kidnap,
  clutter,
  change,
  slip,
  imu,
  imu_bias,
  roughness,
  ray_angle,
  crowd,
};

/// SplitMix64 with the distributions that the simulation needs. Unlike the distributions of
/// <random>, they do not differ between standard libraries.
class Random {
 public:
  constexpr explicit Random(std::uint64_t seed) noexcept : state_(seed) {}

  constexpr std::uint64_t next() noexcept {
    const std::uint64_t x = scatter(state_);
    state_ += 0x9e3779b97f4a7c15ULL;
    return x;
  }
  /// In [0, 1), 53 random bits.
  constexpr double uniform() noexcept { return static_cast<double>(next() >> 11U) * 0x1p-53; }
  constexpr double uniform(double low, double high) noexcept {
    return low + (high - low) * uniform();
  }
  /// In [-1, 1).
  constexpr double symmetric() noexcept { return 2.0 * uniform() - 1.0; }
  constexpr bool chance(double probability) noexcept { return uniform() < probability; }
  /// Standard normal (Box and Muller); always uses two numbers.
  double normal() noexcept {
    const double radius = std::sqrt(-2.0 * std::log(1.0 - uniform()));
    return radius * std::cos(2.0 * std::numbers::pi * uniform());
  }
  /// A vector of numbers. The last one is drawn first: were they the arguments of one call, the
  /// compiler would choose the order, and with it the world.
  /// @param number  as in `vector<3>(&Random::normal)`
  template <int kSize>
  Eigen::Matrix<double, kSize, 1> vector(double (Random::*number)()) {
    Eigen::Matrix<double, kSize, 1> all;
    for (int k = kSize; k-- > 0;) all[k] = (this->*number)();
    return all;
  }

 private:
  std::uint64_t state_;
};

}  // namespace vantage::simulation
