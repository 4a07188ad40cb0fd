#pragma once

#include <array>
#include <bit>
#include <cstddef>
#include <cstdint>
#include <type_traits>

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

/// The hash of a grid cell for an unordered container. The indices of a cell are integers, or whole
/// numbers in doubles; 0 and -0 have the same hash.
struct CellHash {
  template <class Index, std::size_t N>
  [[nodiscard]] constexpr std::size_t operator()(const std::array<Index, N>& cell) const noexcept {
    std::uint64_t sum = 0;
    for (const Index index : cell) {
      if constexpr (std::is_floating_point_v<Index>) {
        sum = scatter(sum ^ std::bit_cast<std::uint64_t>(index + 0.0));
      } else {
        sum = scatter(sum ^ static_cast<std::uint64_t>(index));
      }
    }
    return sum;
  }
};

}  // namespace vantage
