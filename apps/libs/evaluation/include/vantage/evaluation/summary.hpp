#pragma once

#include <array>
#include <cstddef>
#include <cstdint>

#include "vantage/evaluation/run.hpp"
#include "vantage/evaluation/statistics.hpp"

namespace vantage {

/// How far the estimated motion between two scans is from the true one: the translation and the
/// rotation angle of (true motion)^-1 * (estimated motion).
struct RelativeErrors {
  Statistics m, deg;
};

/// The numbers of a run that people compare. Errors and scores are taken over tracked scans.
struct RunSummary {
  std::size_t scans = 0, tracked = 0, lost = 0, recovered = 0, switches = 0, outside = 0;
  std::size_t blocking_loads = 0;  ///< switches to a map that was not ready
  /// Scans more than 2 m or 5 degrees from the reference, and how many of them count as tracked.
  std::size_t far_off = 0, tracked_far_off = 0;
  std::uint64_t dropped_points = 0;
  Statistics error_m, error_deg;
  RelativeErrors relative_frame;   ///< from each scan to the next; both tracked
  RelativeErrors relative_10m;     ///< to the first scan 10 m on along the reference; both tracked
  Statistics align_ms, search_ms;  ///< search: over the scans for which the sensor was searched for
  Statistics stall_ms;             ///< time that scans waited for their map
  Statistics load_ms, prepare_ms;  ///< over switches, on any thread
  Statistics sigma_m;              ///< largest standard deviation that the run claims
  /// Share of the errors along map axes within 1, 2 and 3 of the claimed standard deviations.
  std::array<double, 3> within_sigmas_translation{}, within_sigmas_rotation{};
  std::size_t held_bytes = 0;  ///< most memory that ready maps held at once
  Statistics map_points, iterations, fitness, nvtl, coverage, lcp;
};

[[nodiscard]] RunSummary summarize(const Run& run);

}  // namespace vantage
