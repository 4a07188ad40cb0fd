#pragma once

#include <array>
#include <cstddef>
#include <string_view>
#include <vector>

#include "vantage/evaluation/run.hpp"
#include "vantage/evaluation/statistics.hpp"

namespace vantage {

/// How far the estimated motion between two scans is from the true one: the translation and the
/// rotation angle of (true motion)^-1 * (estimated motion).
struct RelativeErrors {
  Statistics m, deg;
};

/// The numbers of a run that people compare.
struct RunSummary {
  std::size_t scans = 0, tracked = 0;
  std::vector<Statistics> of_metrics = {};  ///< one for each of metrics()
  RelativeErrors relative_frame;            ///< from each scan to the next; both tracked
  RelativeErrors relative_10m;  ///< to the first scan 10 m on along the reference; both tracked
  /// Share of the errors along map axes within 1, 2 and 3 of the standard deviations claimed.
  std::array<double, 3> within_sigmas_translation{}, within_sigmas_rotation{};

  /// The statistics of the metric with this key, over the scans that have a value; empty if there
  /// is no such metric.
  [[nodiscard]] Statistics operator[](std::string_view key) const;
  /// The sum of a metric that counts scans or points.
  [[nodiscard]] std::size_t count(std::string_view key) const;
};

[[nodiscard]] RunSummary summarize(const Run& run);

}  // namespace vantage
