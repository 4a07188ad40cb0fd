#pragma once

#include <cstddef>

namespace vantage::benchmarks {

/// How often something happened.
struct Count {
  std::size_t hits = 0, of = 0;

  void add(bool hit) noexcept {
    hits += hit ? 1 : 0;
    ++of;
  }
  void add(const Count& other) noexcept {
    hits += other.hits;
    of += other.of;
  }
  /// 0 if nothing was counted.
  [[nodiscard]] double share() const noexcept {
    return of > 0 ? static_cast<double>(hits) / static_cast<double>(of) : 0.0;
  }
};

struct Interval {
  double low = 0.0, high = 1.0;
};

/// The exact interval of Clopper and Pearson for the probability behind a count (Biometrika 26,
/// 1934). It takes the trials as independent. [0, 1] if nothing was counted.
/// @param confidence  of the interval, in (0, 1)
[[nodiscard]] Interval clopper_pearson(const Count& count, double confidence = 0.95);

/// The one-sided upper limit of that probability; 1 if nothing was counted.
[[nodiscard]] double upper_limit(const Count& count, double confidence = 0.95);

/// The exact interval of Garwood (Biometrika 28, 1936) for the mean of a Poisson distribution, from
/// the number of events that were counted.
[[nodiscard]] Interval poisson_interval(std::size_t events, double confidence = 0.95);

}  // namespace vantage::benchmarks
