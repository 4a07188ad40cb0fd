#pragma once

#include <atomic>
#include <cstdint>
#include <span>
#include <vector>

#include "build/surfaces.hpp"
#include "stopwatch.hpp"
#include "vantage/engine/build.hpp"
#include "vantage/point_cloud.hpp"
#include "vantage/prepared_map.hpp"
#include "vantage/result.hpp"
#include "vantage/scan_matcher.hpp"

namespace vantage {

/// Chooses which elements of regions' prepared maps are kept: looks at them with scans in and
/// around a region, asks the selector for an order, and keeps as many as the budget allows. Thread
/// safety: const methods may run on one object from many threads at once.
class Selection {
 public:
  /// All arguments but the map are borrowed.
  /// @param whole  the whole map, prepared
  /// @param map    N points, map frame [m]; only used during this call
  Selection(const MatchTarget& whole, const Selector& selector, const SelectionParams& params,
            double max_range, PointsView map);

  /// How far around a region's viewpoints the map decides about the choice [m].
  [[nodiscard]] static double reach(const BuildParams& params);

  /// @param seen        the region's observable points, map frame [m]
  /// @param viewpoints  of the region, map frame [m]; none: nothing can be chosen by
  /// Errors: those of the selector and of MatchTarget; `internal` for a selector that breaks its
  /// contract.
  [[nodiscard]] Result<PreparedMap> of(PointsView seen, std::span<const Point> viewpoints) const;

  /// Processor time so far [s].
  [[nodiscard]] double core_seconds() const noexcept {
    return 1e-9 * static_cast<double>(nanoseconds_.load());
  }

 private:
  [[nodiscard]] Result<PreparedMap> chosen(PointsView seen,
                                           std::span<const Point> viewpoints) const;
  [[nodiscard]] Result<std::vector<LocatedScan>> scans_at(std::span<const Point> viewpoints) const;

  const MatchTarget& whole_;
  const Selector& selector_;
  const SelectionParams& params_;
  Rays rays_;
  CpuStopwatch preparing_;
  Surfaces surfaces_;
  mutable std::atomic<std::int64_t> nanoseconds_;
};

}  // namespace vantage
