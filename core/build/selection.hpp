#pragma once

#include <atomic>
#include <cstdint>
#include <span>
#include <utility>
#include <vector>

#include "build/surfaces.hpp"
#include "vantage/build/build.hpp"
#include "vantage/engine/predicted_errors.hpp"
#include "vantage/kit/stopwatch.hpp"
#include "vantage/point_cloud.hpp"
#include "vantage/prepared_map.hpp"
#include "vantage/result.hpp"
#include "vantage/scan_matcher.hpp"
#include "vantage/selector.hpp"

namespace vantage {

/// What is kept of a region's prepared map.
struct Selected {
  PreparedMap prepared;
  std::vector<PredictedError> errors = {};  ///< at the places of the choice
};

/// The numbers of a region's elements in the target, and in the region; ascending.
using OwnNumbers = std::vector<std::pair<std::uint32_t, std::uint32_t>>;

/// Where a scan is taken.
struct ScanPlace {
  Point at;                           ///< of the sensor, map frame [m]
  const LocatedScan* scan = nullptr;  ///< none: it is virtual
};

/// What a region's elements do to the poses of some scans.
struct Views {
  PointCloud places = {};                     ///< of the scans, map frame [m]
  std::vector<std::vector<Pull>> pulls = {};  ///< of each scan, by their numbers in the region
};

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
  [[nodiscard]] Result<Selected> of(PointsView seen, std::span<const Point> viewpoints) const;

  /// Processor time so far [s].
  [[nodiscard]] double core_seconds() const noexcept {
    return 1e-9 * static_cast<double>(nanoseconds_.load());
  }

 private:
  [[nodiscard]] Result<Selected> chosen(PointsView seen, std::span<const Point> viewpoints) const;
  /// Asks the selector for its order, and cuts it off where the first elements keep the target.
  /// @param most  no more elements than these
  [[nodiscard]] Result<std::vector<std::uint32_t>> ordered(std::span<const MapElement> elements,
                                                           const Views& views,
                                                           std::size_t most) const;
  /// The recorded scans near a region.
  [[nodiscard]] std::vector<ScanPlace> recorded_near(std::span<const Point> viewpoints) const;
  /// What the region's elements do at some of these places; not at those that nothing is seen from.
  [[nodiscard]] Result<Views> views_from(std::span<const ScanPlace> places,
                                         std::span<const std::size_t> some,
                                         const OwnNumbers& own_number) const;
  /// What the elements of the whole map do to a virtual scan without noise. They have the numbers
  /// of the target. Empty if the scan hits nothing.
  [[nodiscard]] Result<std::vector<Pull>> virtual_pulls(const Point& place) const;

  const MatchTarget& whole_;
  const Selector& selector_;
  const SelectionParams& params_;
  Rays rays_;
  CpuStopwatch preparing_;
  Surfaces surfaces_;
  mutable std::atomic<std::int64_t> nanoseconds_;
};

}  // namespace vantage
