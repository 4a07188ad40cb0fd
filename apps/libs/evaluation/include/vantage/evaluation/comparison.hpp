#pragma once

#include <optional>
#include <span>
#include <string>
#include <vector>

#include "vantage/evaluation/metrics.hpp"
#include "vantage/evaluation/scan_table.hpp"
#include "vantage/result.hpp"

namespace vantage {

/// An interval that contains the mean of 95 of 100 resamples.
struct Interval {
  double low = 0.0, high = 0.0;
};
/// Uses 2,000 resamples with replacement, always the same ones; the ends are linear between
/// neighbours. Values are taken as independent: if neighbouring values are alike, the true interval
/// is wider.
/// Precondition: at least one value.
[[nodiscard]] Interval bootstrap_mean(std::span<const double> values);

/// A metric in two runs, over the scans for which both have it.
struct Compared {
  const Metric* metric = nullptr;
  std::vector<std::size_t> pairs = {};                  ///< into Comparison::pairs
  std::vector<double> a = {}, b = {};                   ///< of each of them, in the unit shown
  double mean_a = 0.0, mean_b = 0.0, difference = 0.0;  ///< difference: mean of b - a
  Interval interval = {};                               ///< of the difference
  std::optional<double> share_better = {};  ///< scans where b is better than a; none for `neither`
};

/// A metric that is counted, over the scans of both runs.
struct ComparedCount {
  const Metric* metric = nullptr;
  std::size_t a = 0, b = 0;
};

/// A scan that is in both runs, as indices into their tables.
struct ScanPair {
  std::size_t a = 0, b = 0;
};

struct Comparison {
  ScanTable a, b;
  std::vector<ScanPair> pairs = {};
  std::vector<double> only_a = {}, only_b = {};  ///< stamps [s]
  std::vector<ComparedCount> counts = {};        ///< of the pairs, if both runs have any
  std::vector<Compared> quantities = {};         ///< those that any pair has
};

/// Pairs the scans whose stamps agree to a microsecond. Errors and scores are taken over scans
/// tracked in both runs; times and sizes over all pairs.
/// Errors: `invalid_input` with file and line if no scan is in both runs.
[[nodiscard]] Result<Comparison> compare(ScanTable a, ScanTable b);

/// "398 scans in both; only in A: 2 (12.3 s, 12.4 s)".
[[nodiscard]] std::string pairing_text(const Comparison& comparison);

/// Rows of text, header first.
[[nodiscard]] std::vector<std::vector<std::string>> rows_of(const Comparison& comparison);

}  // namespace vantage
