#pragma once

#include <cstddef>
#include <cstdint>
#include <functional>
#include <limits>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "vantage/api.hpp"
#include "vantage/build/outliers.hpp"
#include "vantage/build/thinning.hpp"
#include "vantage/build/viewpoints.hpp"
#include "vantage/engine/config.hpp"
#include "vantage/engine/plugin_loader.hpp"
#include "vantage/map_store.hpp"
#include "vantage/point_cloud.hpp"
#include "vantage/relocalizer.hpp"
#include "vantage/result.hpp"

namespace vantage {

/// The plugins that a build runs.
struct BuildPlugins {
  PluginPtr<Partitioner> partitioner;
  PluginPtr<GroundFilter> ground;  ///< none if viewpoints come from the trajectory
  PluginPtr<VisibilityOperator> visibility;
  PluginPtr<MapStore> store;
  PluginPtr<Selector> selector;        ///< none: prepared maps keep all their elements
  PluginPtr<ScanMatcher> matcher;      ///< none unless prepared maps are stored
  PluginPtr<Relocalizer> relocalizer;  ///< none: no index of places is made
};

/// A scan whose pose is known.
struct LocatedScan {
  PointCloud points;  ///< sensor frame [m], as prepare_scan thins them
  Pose T_map_scan;
};

/// How a selector chooses which elements of a region's prepared map are kept.
struct SelectionParams {
  std::optional<std::uint32_t> max_bytes;  ///< of a region; not with `share`
  std::optional<double> share;             ///< of a region's elements
  /// No more are kept than it takes for this error at 95 % of the places of its scans [m].
  std::optional<double> target_error;
  std::size_t places = 16;  ///< scans that a region's choice is made with
  /// Scans of the map's own recording. Those near a region are taken before virtual ones.
  std::vector<LocatedScan> scans;
  double lowest = -23.0, highest = 15.0;  ///< elevations of the sensor's rays [deg]
};

/// The parameters of the build itself, apart from those of the plugins.
struct BuildParams {
  ViewpointParams viewpoints;
  std::optional<OutlierParams> outliers;  ///< none: the ground filter gets all points
  VisibilityScope scope = VisibilityScope::map;
  double max_range = std::numeric_limits<double>::infinity();  ///< [m]
  /// A point is kept if this many viewpoints of its region see it, or all if there are fewer.
  std::uint32_t min_views = 1;
  std::optional<ThinningParams> thinning;  ///< applied to the points that are kept
  StoredContent content = StoredContent::points;
  SelectionParams selection;     ///< for BuildPlugins::selector
  bool views = false;            ///< whether points are stored with their view counts
  std::string effective_config;  ///< stored in the bundle
  /// Bytes that the bundle keeps by name, see MapWriter::attach. A store of regions only leaves
  /// them.
  std::vector<std::pair<std::string, std::vector<std::byte>>> attachments;

  /// The parameters in a configuration; leaves `effective_config` empty.
  [[nodiscard]] VANTAGE_API static BuildParams from(const Config& config);
};

struct BuildProgress {
  std::size_t regions_done = 0, regions = 0;        ///< regions that are stored
  std::size_t viewpoints_done = 0, viewpoints = 0;  ///< includes those of unfinished regions
};

/// What a build made and what it cost (the data of Table 1).
struct BuildReport {
  Partition partition;
  /// By RegionId. `points` counts the points after thinning, whether they are stored or not.
  /// `bytes` and `max_views` are 0; only the store's index has them.
  std::vector<RegionSummary> regions;
  std::vector<std::uint64_t> seen;  ///< by RegionId: points seen by any viewpoint, kept or not
  std::uint64_t map_points = 0;
  std::uint64_t ground_points = 0;
  std::uint64_t viewpoints = 0;
  std::uint64_t unreachable_voxels = 0;  ///< of the map's ground; no viewpoint is over them
  std::uint64_t places_outside = 0;  ///< along the trajectory, outside all regions: no viewpoint
  std::uint64_t skipped_viewpoints = 0;          ///< of `viewpoints`; left out by `min_gain`
  std::uint64_t regions_without_viewpoints = 0;  ///< without ground or path: empty maps
  std::uint64_t regions_that_see_nothing = 0;    ///< whose viewpoints see no point: empty maps
  double seconds_partition = 0, seconds_ground = 0, seconds_visibility = 0;  ///< wall clock
  double core_seconds_visibility = 0;  ///< processor time of all threads, storing included
  double core_seconds_selection = 0;   ///< of choosing elements; not in that of visibility
  double points_times_viewpoints = 0;  ///< sum over viewpoints of the points that each tested

  /// The cost of visibility per viewpoint and million points [s]: comparable between maps.
  [[nodiscard]] double core_seconds_a_viewpoint_and_million_points() const noexcept {
    return points_times_viewpoints > 0 ? 1e6 * core_seconds_visibility / points_times_viewpoints
                                       : 0.0;
  }
};

/// Loads the plugins that a build needs: the ground filter only for viewpoints over the ground, the
/// matcher only for prepared content.
/// Errors: a missing table or plugin, or a wrong parameter; viewpoints along a trajectory if [map]
/// names none.
[[nodiscard]] VANTAGE_API Result<BuildPlugins> load_build_plugins(const Config& config,
                                                                  const PluginLoader& loader);

/// Makes the observable map of every region and stores it (Sec. 2.1-2.3), with an index of places
/// if the store keeps attachments. Runs in parallel over regions and viewpoints,
/// within the limits of the caller's TBB arena. The bundle does not depend on the number of
/// threads.
/// @param map         N points of P, map frame, z up [m]; finite
/// @param trajectory  positions of the sensor while mapping, in driving order, map frame [m]; may
///                    be empty unless viewpoints come from it
/// @param progress    called from one thread at a time: first with nothing done, then after every
///                    region, and in between after each hundredth of the viewpoints or 0.1 s.
///                    Counts never fall. It must not use TBB. An exception that it throws leaves
///                    this function. May be empty
/// Errors: `invalid_input` for an empty or non-finite map, for a map without ground if viewpoints
/// need it, for a trajectory that gives no viewpoints, or if no viewpoint sees a point; errors of
/// the plugins, for example `unsupported` from a matcher that cannot store what it prepares;
/// `internal` for a plugin that breaks its contract. Nothing is stored on error.
[[nodiscard]] VANTAGE_API Result<BuildReport> build_region_maps(
    PointsView map, PointsView trajectory, BuildPlugins& plugins, const BuildParams& params,
    const std::function<void(const BuildProgress&)>& progress = {});

}  // namespace vantage
