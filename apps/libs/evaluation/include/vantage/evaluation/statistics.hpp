#pragma once

#include <cstddef>
#include <span>

namespace vantage {

/// A sample in a few numbers; all zero for an empty one. Percentiles are linear between neighbours.
struct Statistics {
  std::size_t count = 0;
  double sum = 0, mean = 0, rmse = 0, std = 0, min = 0, median = 0, p95 = 0, p99 = 0, max = 0;
};

/// Spearman's rank correlation; 0 if all values of one are equal.
/// @param a  one number for each of `b`
[[nodiscard]] double rank_correlation(std::span<const double> a, std::span<const double> b);

[[nodiscard]] Statistics statistics_of(std::span<const double> sample);

/// The value below which a share of a sample lies, linear between neighbours.
/// @param sorted  ascending; not empty
/// @param share   0 to 1
[[nodiscard]] double percentile(std::span<const double> sorted, double share);

}  // namespace vantage
