#pragma once

#include <cmath>
#include <cstdint>
#include <numbers>

namespace vantage::simulation {

/// The finalizer of SplitMix64 (Steele, Lea and Flood, 2014): a bijection that scatters bits.
[[nodiscard]] constexpr std::uint64_t scatter(std::uint64_t x) noexcept {
  x += 0x9e3779b97f4a7c15ULL;
  x = (x ^ (x >> 30U)) * 0xbf58476d1ce4e5b9ULL;
  x = (x ^ (x >> 27U)) * 0x94d049bb133111ebULL;
  return x ^ (x >> 31U);
}

/// One seed out of several numbers; the order of the numbers matters.
template <class... Numbers>
[[nodiscard]] constexpr std::uint64_t hash(std::uint64_t seed, Numbers... numbers) noexcept {
  ((seed = scatter(seed ^ scatter(static_cast<std::uint64_t>(numbers)))), ...);
  return seed;
}

/// What a seed is used for, so that no two uses share their numbers.
enum class Purpose : std::uint64_t { terrain, streets, block, map_point, ray, odometry, kidnap };

/// SplitMix64 with the distributions that the simulation needs. The distributions of <random>
/// differ between standard libraries; these do not.
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
  /// Standard normal (Box and Muller); always takes two numbers.
  double normal() noexcept {
    const double radius = std::sqrt(-2.0 * std::log(1.0 - uniform()));
    return radius * std::cos(2.0 * std::numbers::pi * uniform());
  }

 private:
  std::uint64_t state_;
};

}  // namespace vantage::simulation
