#pragma once

#include <array>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "vantage/evaluation/scan_table.hpp"
#include "vantage/result.hpp"

namespace vantage {

/// An interval of the mean that 95 of 100 resamples fall into.
struct Interval {
  double low = 0.0, high = 0.0;
};
/// By 2,000 resamples with replacement, always the same ones; ends linear between neighbours.
/// Values are taken as independent: where neighbours are alike, the truth is wider.
/// Precondition: at least one value.
[[nodiscard]] Interval bootstrap_mean(std::span<const double> values);

/// A quantity in two runs, over the scans for which both have it.
struct Compared {
  std::string name;    ///< "position error"
  std::string column;  ///< of scans.csv
  std::string unit;    ///< of all values here; may be empty
  int digits = 2;
  enum class Better { neither, less, more } better = Better::neither;
  std::vector<std::size_t> pairs;                       ///< into Comparison::pairs
  std::vector<double> a, b;                             ///< of each of them
  double mean_a = 0.0, mean_b = 0.0, difference = 0.0;  ///< difference: mean of b - a
  Interval interval;                                    ///< of the difference
  std::optional<double> share_better;  ///< scans where b is better than a; none for `neither`
};

/// A scan that is in both runs, as indices into their tables.
struct ScanPair {
  std::size_t a = 0, b = 0;
};

struct Comparison {
  ScanTable a, b;
  std::vector<ScanPair> pairs;
  std::vector<double> only_a, only_b;     ///< stamps [s]
  std::array<std::size_t, 2> lost{};      ///< of the pairs
  std::array<std::size_t, 2> switches{};  ///< of the pairs
  std::array<std::size_t, 2> blocking{};  ///< of the pairs
  std::vector<Compared> quantities;       ///< those that any pair has
};

/// Pairs scans whose stamps agree to a microsecond. Errors and scores are of scans tracked in both
/// runs; times and sizes of all pairs.
/// Errors: `invalid_input` with file and line if no scan is in both.
[[nodiscard]] Result<Comparison> compare(ScanTable a, ScanTable b);

/// "398 scans in both; only in A: 2 (12.3 s, 12.4 s)".
[[nodiscard]] std::string pairing_text(const Comparison& comparison);

/// Rows of text, header first.
[[nodiscard]] std::vector<std::vector<std::string>> rows_of(const Comparison& comparison);

}  // namespace vantage
