#pragma once

#include <array>
#include <optional>
#include <span>
#include <string>
#include <vector>

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

/// A quantity in two runs, over the scans for which both runs have it.
struct Compared {
  std::string name;    ///< "position error"
  std::string column;  ///< column of scans.csv
  std::string unit;    ///< of all values here; may be empty
  int digits = 2;
  enum class Better { neither, less, more } better = Better::neither;
  std::vector<std::size_t> pairs;                       ///< into Comparison::pairs
  std::vector<double> a, b;                             ///< one value for each of these pairs
  double mean_a = 0.0, mean_b = 0.0, difference = 0.0;  ///< difference: mean of b - a
  Interval interval;                                    ///< of `difference`
  std::optional<double> share_better;  ///< share of scans where b is better; none for `neither`
};

/// A scan that is in both runs, as indices into their tables.
struct ScanPair {
  std::size_t a = 0, b = 0;
};

struct Comparison {
  ScanTable a, b;
  std::vector<ScanPair> pairs;
  std::vector<double> only_a, only_b;     ///< stamps [s]
  std::array<std::size_t, 2> lost{};      ///< among the pairs
  std::array<std::size_t, 2> switches{};  ///< among the pairs
  std::array<std::size_t, 2> blocking{};  ///< among the pairs
  std::vector<Compared> quantities;       ///< those that at least one pair has
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
