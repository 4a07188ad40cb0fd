#pragma once

#include <cstddef>
#include <filesystem>
#include <functional>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "vantage/api.hpp"
#include "vantage/build/build.hpp"
#include "vantage/build/sharded_build.hpp"
#include "vantage/engine/bundle.hpp"
#include "vantage/engine/config.hpp"
#include "vantage/engine/plugin_loader.hpp"
#include "vantage/map_store.hpp"
#include "vantage/point_cloud.hpp"
#include "vantage/result.hpp"

namespace vantage {

/// A build of the bundle that a configuration describes. The bundle stores this configuration,
/// without the settings that may differ at run time.
///
///     VANTAGE_TRY(BundleBuild build, BundleBuild::prepare(config, plugins));
///     VANTAGE_TRY(const BuildReport report, build.run(map, trajectory));
class VANTAGE_API BundleBuild {
 public:
  /// Loads the plugins and checks the whole configuration, including what only localization uses:
  /// a mistake shows now, not on the robot.
  /// Errors: those of load_build_plugins and effective_config.
  [[nodiscard]] static Result<BundleBuild> prepare(const Config& config,
                                                   const PluginLoader& plugins);

  /// Whether the store takes the bundle, as far as it can tell before anything is computed.
  /// Errors: those of MapStore::may_begin.
  [[nodiscard]] Result<void> may_begin() const;

  /// Where the bundle is going to be, without a slash at its end; none if the store needs more than
  /// a path, see Bundle::open.
  [[nodiscard]] const std::optional<std::filesystem::path>& place() const noexcept {
    return place_;
  }

  /// Keeps bytes in the bundle, see BuildParams::attachments. Call before `run` or `sharded`.
  void attach(std::string name, std::vector<std::byte> bytes);

  /// Scans of the map's own recording, for the selector. Call before `run` or `sharded`.
  void choose_with(std::vector<LocatedScan> scans) { params_.selection.scans = std::move(scans); }

  /// Call once. Parameters and errors: those of build_region_maps.
  [[nodiscard]] Result<BuildReport> run(
      PointsView map, PointsView trajectory,
      const std::function<void(const BuildProgress&)>& progress = {});

  /// The same for a map of which only a part is in memory at a time, in one process or several.
  /// All arguments but the options are borrowed. Errors: those of ShardedBuild::open.
  [[nodiscard]] Result<ShardedBuild> sharded(const MapParts& map, PointsView trajectory,
                                             ShardedBuildOptions options);

  /// The bundle that the build made; call it after `run`. Errors: those of MapStore::open and
  /// Bundle::of.
  [[nodiscard]] Result<Bundle> bundle() const;

 private:
  BundleBuild(BuildPlugins plugins, BuildParams params, std::optional<std::filesystem::path> place)
      : plugins_(std::move(plugins)), params_(std::move(params)), place_(std::move(place)) {}
  BuildPlugins plugins_;
  BuildParams params_;
  std::optional<std::filesystem::path> place_;
};

}  // namespace vantage
