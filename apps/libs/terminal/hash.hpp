#pragma once

#include <cstdint>

namespace vantage {

/// The finalizer of SplitMix64 (Steele, Lea and Flood, 2014): a bijection that scatters bits.
[[nodiscard]] constexpr std::uint64_t scatter(std::uint64_t x) noexcept {
  x += 0x9e3779b97f4a7c15ULL;
  x = (x ^ (x >> 30U)) * 0xbf58476d1ce4e5b9ULL;
  x = (x ^ (x >> 27U)) * 0x94d049bb133111ebULL;
  return x ^ (x >> 31U);
}

/// Combines several numbers into one seed; their order matters.
template <class... Numbers>
[[nodiscard]] constexpr std::uint64_t hash(std::uint64_t seed, Numbers... numbers) noexcept {
  ((seed = scatter(seed ^ scatter(static_cast<std::uint64_t>(numbers)))), ...);
  return seed;
}

}  // namespace vantage
