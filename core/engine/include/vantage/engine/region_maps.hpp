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
  std::uint64_t map_points = 0;  ///< N_point of Eq. 13: points, or elements if no points are stored
  double seconds_load = 0.0;     ///< time to read it from the store
  double seconds_prepare = 0.0;  ///< time to make it ready for matching
  std::size_t bytes_read = 0;    ///< points and prepared bytes, which are gone now [bytes]
  std::size_t bytes_at_first = 1;  ///< that the region held before it was used; not 0

  /// Memory that the region holds now. A target may take more while it is used.
  [[nodiscard]] std::size_t bytes() const { return target->bytes(); }
};

/// What scans are matched to in a region: its prepared map if one is stored, otherwise its points.
/// Errors: those of ScanMatcher::restore and ScanMatcher::prepare; `too_few_matches` for a region
/// that stores neither, because nothing is seen there or nothing that the matcher can use.
[[nodiscard]] VANTAGE_API Result<PluginPtr<MatchTarget>> target_in(
    const RegionMap& map, const PluginPtr<ScanMatcher>& matcher);

/// Makes a region ready for matching. Errors: those of MapReader::get and target_in.
[[nodiscard]] VANTAGE_API Result<std::shared_ptr<const ReadyRegion>> make_ready(
    const MapReader& bundle, const PluginPtr<ScanMatcher>& matcher, RegionId region);

/// Region maps at run time: the maps that were needed last and those that will be needed soon,
/// within a memory limit. A separate thread loads the expected maps. Taking a region that is ready
/// costs one table look-up.
///
/// The timing of that thread never changes which map is taken: the caller waits for a region that
/// is not ready.
/// Thread safety: `take`, `borrow` and `expect` may run at once from several threads.
class VANTAGE_API RegionMaps {
 public:
  struct Options {
    /// Limit [bytes]. These count: maps that are kept or borrowed, maps on their way with their
    /// points, the growth to expect of maps in use, and what was set aside. Taking or loading a
    /// region enforces the limit. The last region taken and borrowed maps stay. Expected regions
    /// leave only if the maps alone are beyond the limit.
    std::size_t memory = std::size_t{40} << 20U;
    bool background = true;  ///< false: `expect` does nothing
  };

  /// @param bundle, matcher  must outlive the object
  RegionMaps(const MapReader& bundle, const PluginPtr<ScanMatcher>& matcher,
             const Options& options);
  RegionMaps(const RegionMaps&) = delete;
  RegionMaps& operator=(const RegionMaps&) = delete;
  ~RegionMaps();

  struct Taken {
    std::shared_ptr<const ReadyRegion> region;
    bool blocked = false;  ///< the region was not ready: the call loaded it or waited for it
  };
  /// Errors: those of make_ready; the next call tries again.
  [[nodiscard]] Result<Taken> take(RegionId region);

  /// Returns a region if it is ready, or as long as somebody holds what was borrowed before.
  /// Otherwise loads it for the caller and does not keep it. Errors: those of make_ready.
  [[nodiscard]] Result<std::shared_ptr<const ReadyRegion>> borrow(RegionId region) const;

  /// From now on, something else takes so much of the memory limit [bytes].
  void set_aside(std::size_t bytes) const;

  /// Announces the regions that will be taken soon, the soonest first. Replaces the previous
  /// announcement. The regions are loaded in this order while they fit into the memory limit.
  /// `take` reports a failure to load. Returns at once.
  void expect(std::vector<RegionId> regions);

  /// Waits until every expected region is ready, does not fit, or has failed.
  void wait_until_idle() const;

  struct Statistics {
    std::uint64_t loaded_by_taker = 0, loaded_in_background = 0, dropped = 0;
    std::size_t bytes = 0;    ///< of all maps that are in memory now
    std::size_t regions = 0;  ///< kept now
  };
  [[nodiscard]] Statistics statistics() const;

 private:
  struct State;
  std::unique_ptr<State> state_;
};

}  // namespace vantage
