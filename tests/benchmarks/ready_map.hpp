#pragma once

#include <memory>
#include <string>
#include <vector>

#include "vantage/build/build.hpp"
#include "vantage/engine/config.hpp"
#include "vantage/engine/plugin_loader.hpp"
#include "vantage/engine/region_maps.hpp"
#include "vantage/map_store.hpp"
#include "vantage/scan_matcher.hpp"

namespace vantage::benchmarks {

/// A matcher as an option names it: "ndt" or "ndt: resolution = 2.0; neighbours = \"direct1\"".
struct MatcherOption {
  std::string name, params;  ///< params: TOML, a line each

  [[nodiscard]] static MatcherOption from(const std::string& text);
  /// Errors: those of the loader, of params that are no TOML or that the plugin refuses.
  [[nodiscard]] Result<PluginPtr<ScanMatcher>> load() const;
  /// What puts it into a configuration.
  [[nodiscard]] std::vector<std::string> overrides() const;
};

/// A map made ready for matching: one target for everywhere, or one for each region.
class ReadyMap {
 public:
  [[nodiscard]] static ReadyMap everywhere(PluginPtr<MatchTarget> target);
  /// The regions of a bundle, all of them; those whose map is empty match nothing.
  /// Errors: those of the store and the matcher.
  [[nodiscard]] static Result<ReadyMap> of_bundle(const MapReader& bundle,
                                                  const PluginPtr<ScanMatcher>& matcher);

  /// The region that a localizer at `place` [m] matches against (Eq. 11): the one that owns it,
  /// outside all the nearest. `RegionId{0}` if there are no regions.
  [[nodiscard]] RegionId region_at(const Point& place) const;
  /// Errors: `too_few_matches` if the map there is empty; those of MatchTarget::align.
  [[nodiscard]] Result<Alignment> align(PointsView scan, const Pose& T_map_scan_guess) const;

  /// Of the bundle; no regions if the map is one.
  [[nodiscard]] const MapIndex& index() const noexcept { return index_; }

 private:
  MapIndex index_;
  std::vector<std::shared_ptr<const ReadyRegion>> regions_;  // nullptr: empty
};

/// Builds the bundle of a configuration, whose [store] says where, from a map in memory [m].
/// Errors: those of BundleBuild.
[[nodiscard]] Result<BuildReport> build_bundle(const Config& config, PointsView map);

}  // namespace vantage::benchmarks
