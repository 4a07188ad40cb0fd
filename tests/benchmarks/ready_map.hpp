#pragma once

#include <cstdint>
#include <filesystem>
#include <memory>
#include <string>
#include <vector>

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
};

/// A map made ready for matching: one target for everywhere, or one for each region.
class ReadyMap {
 public:
  [[nodiscard]] static ReadyMap everywhere(PluginPtr<MatchTarget> target);
  /// The regions of a bundle, all of them; those whose map is empty match nothing.
  /// Errors: those of the store and the matcher.
  [[nodiscard]] static Result<ReadyMap> of_bundle(const PluginPtr<MapStore>& store,
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

/// Errors: `invalid_input` for a bundle that keeps anything but `content`, or nothing.
/// @param content  points or prepared
[[nodiscard]] Result<void> check_content(const MapIndex& index, StoredContent content);

/// The bundle of a configuration.
/// Errors: those of the configuration, of the store and of `check_content`.
[[nodiscard]] Result<PluginPtr<MapStore>> open_bundle(const std::filesystem::path& config,
                                                      const std::vector<std::string>& overrides,
                                                      StoredContent content);

/// The recorded street in regions of 20 m by hpr, configs/kitti_street/L20.toml, built by
/// `vantage-build` into a folder: what to add to the configuration to open it.
/// @param content  points or prepared
/// Errors: `internal` with what the program said.
[[nodiscard]] Result<std::vector<std::string>> build_L20(const std::filesystem::path& map,
                                                         const std::filesystem::path& bundle,
                                                         StoredContent content,
                                                         const MatcherOption& matcher);
inline constexpr const char* kL20 = VANTAGE_SOURCE_DIR "/configs/kitti_street/L20.toml";

}  // namespace vantage::benchmarks
