#pragma once

#include <cstddef>
#include <cstdint>
#include <memory>
#include <vector>

#include "vantage/api.hpp"
#include "vantage/engine/plugin_loader.hpp"
#include "vantage/map_store.hpp"
#include "vantage/result.hpp"
#include "vantage/scan_matcher.hpp"

namespace vantage {

/// One region's map, ready to match against. Immutable.
struct ReadyRegion {
  PluginPtr<MatchTarget> target;
  PointCloud viewpoints;         ///< map frame [m]
  std::uint64_t map_points = 0;  ///< N_point of Eq. 13: points, or elements if no points are stored
  std::size_t bytes = 0;         ///< memory that the region holds
  double seconds_load = 0.0;     ///< reading it from the store
  double seconds_prepare = 0.0;  ///< making it ready
};

/// Reads a region's map and makes it ready, from its prepared state if there is one, otherwise from
/// its points. Errors: those of MapStore::get, ScanMatcher::restore and ScanMatcher::prepare.
[[nodiscard]] VANTAGE_API Result<std::shared_ptr<const ReadyRegion>> make_ready(
    const PluginPtr<MapStore>& store, const PluginPtr<ScanMatcher>& matcher, RegionId region);

/// Region maps at run time: the maps that were needed last and those that will be needed soon,
/// within a memory limit. A separate thread loads the expected maps. Taking a region that is ready
/// costs one table look-up.
///
/// Which map is taken never depends on that thread: the caller waits for a region that is not
/// ready.
/// Thread safety: `take` and `expect` may run at once from several threads.
class VANTAGE_API RegionMaps {
 public:
  struct Options {
    std::size_t memory = std::size_t{40} << 20U;  ///< limit [bytes]; the region taken last stays
    bool background = true;                       ///< whether `expect` does anything
  };

  /// @param store, matcher  must outlive the object
  RegionMaps(const PluginPtr<MapStore>& store, const PluginPtr<ScanMatcher>& matcher,
             const Options& options);
  RegionMaps(const RegionMaps&) = delete;
  RegionMaps& operator=(const RegionMaps&) = delete;
  ~RegionMaps();

  struct Taken {
    std::shared_ptr<const ReadyRegion> region;
    bool blocked = false;  ///< it was not ready: the call loaded it or waited for it
  };
  /// Errors: those of make_ready; the next call tries again.
  [[nodiscard]] Result<Taken> take(RegionId region);

  /// Returns a region that is ready; otherwise loads it for the caller and does not keep it.
  /// Errors: those of make_ready.
  [[nodiscard]] Result<std::shared_ptr<const ReadyRegion>> borrow(RegionId region) const;

  /// Says which regions will be taken soon, the soonest first. This replaces what was expected
  /// before. The regions are loaded in this order as long as they fit into the memory limit. A
  /// failure is reported when the region is taken. Returns at once.
  void expect(std::vector<RegionId> regions);

  /// Waits until every expected region is ready, does not fit, or has failed.
  void wait_until_idle() const;

  struct Statistics {
    std::uint64_t loaded_by_taker = 0, loaded_in_background = 0, dropped = 0;
    std::size_t bytes = 0, regions = 0;  ///< held now
  };
  [[nodiscard]] Statistics statistics() const;

 private:
  struct State;
  std::unique_ptr<State> state_;
};

}  // namespace vantage
