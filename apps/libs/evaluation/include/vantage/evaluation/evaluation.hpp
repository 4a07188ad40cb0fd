#pragma once

#include <cstddef>
#include <cstdint>
#include <functional>
#include <optional>
#include <string>
#include <vector>

#include "vantage/engine/atlas.hpp"
#include "vantage/engine/config.hpp"
#include "vantage/engine/plugin_loader.hpp"
#include "vantage/evaluation/gates.hpp"
#include "vantage/evaluation/run.hpp"
#include "vantage/evaluation/statistics.hpp"
#include "vantage/evaluation/summary.hpp"
#include "vantage/io/trajectory_io.hpp"
#include "vantage/map_store.hpp"
#include "vantage/point_cloud.hpp"
#include "vantage/result.hpp"

namespace vantage {

/// A recorded drive.
struct Route {
  std::string name;
  io::Trajectory reference;  ///< T_map_sensor
};

/// One route, localized in one set of region maps.
struct RouteRun {
  Run run;
  RunSummary summary;
};

/// Another way to make region maps as small: as many points in every region, from the same points
/// within the sensor's reach. A lost sensor is looked for within 20 m at most.
struct Baseline {
  std::string name;  ///< "random", "voxel" or "radius"
  std::vector<RouteRun> routes;
};

/// A region map to look at.
struct Specimen {
  RegionId region;
  PointCloud points;      ///< V_ij, map frame [m]
  PointCloud viewpoints;  ///< map frame [m]
};

/// A configuration and all results about it.
struct EvaluatedConfig {
  std::string name;  ///< of the configuration file, without folder and suffix
  MapIndex index;
  Statistics region_points;        ///< over the bundle's regions (Table 1); none without points
  std::uint64_t bundle_bytes = 0;  ///< of the bundle in storage, see Bundle::bytes
  std::vector<RouteRun> routes;    ///< one for each of Evaluation::routes
  std::vector<Baseline> baselines;
  std::string no_baselines;          ///< why some or all of them are missing; empty if none is
  std::optional<Specimen> specimen;  ///< where the first route is halfway; none without points
  std::optional<Atlas> atlas;        ///< of the bundle; none if it was not assessed
  std::vector<GateResult> gates;     ///< for each route, each gate

  /// Share of the wide-area map's points that the mean region map does without, over all regions;
  /// none if the bundle stores no points.
  [[nodiscard]] std::optional<double> reduction() const;
  /// Whether every gate holds; none without gates.
  [[nodiscard]] std::optional<bool> passed() const;
};

/// Configurations side by side on the same routes.
struct Evaluation {
  std::vector<Route> routes;
  std::vector<EvaluatedConfig> configs;
  PointCloud map;  ///< the wide-area map P [m]; empty if it is not available
};

/// A recorded drive with its name.
struct NamedInputs {
  std::string name;  ///< can be the name of a folder
  RunInputs inputs;
};

struct NamedConfig {
  std::string name;  ///< of the file, without folder and suffix
  Config config;
};

struct EvaluationOptions {
  PluginLoader loader;
  bool baselines = true;
  /// Called with what is localized before each run; the run tells its progress to the result.
  std::function<ScanProgress(const std::string&)> progress = {};
};

/// Localizes every route in the region maps of every configuration, and in those of its baselines.
/// Gates are not judged yet.
/// Precondition: every route has a reference.
/// Errors: what localize_scans reports; a wide-area map that is damaged. One that is not there is
/// said in EvaluatedConfig::no_baselines.
[[nodiscard]] Result<Evaluation> evaluate(const std::vector<NamedConfig>& configs,
                                          const std::vector<NamedInputs>& routes,
                                          const EvaluationOptions& options);

/// Whether any region map of a bundle holds points, and not only what a matcher made of them.
[[nodiscard]] bool stores_points(const MapIndex& index);

/// The one configuration whose map is the whole wide-area map in one piece; nullptr without one,
/// or with several.
[[nodiscard]] const EvaluatedConfig* wide_area_config(const Evaluation& evaluation);

}  // namespace vantage
