#pragma once

#include <cstddef>
#include <cstdint>
#include <functional>
#include <optional>
#include <string>
#include <vector>

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

/// Another way to make region maps of the same size: as many points in every region, chosen from
/// the same points within the sensor's reach. A lost sensor is searched for within 20 m at most.
struct Opponent {
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
  Statistics region_points;        ///< over the bundle's regions (Table 1)
  std::uint64_t bundle_bytes = 0;  ///< of all region maps in the store
  std::vector<RouteRun> routes;    ///< one for each of Evaluation::routes
  std::vector<Opponent> opponents;
  std::string no_opponents;          ///< why some or all are missing; else empty
  std::optional<Specimen> specimen;  ///< at the middle of the first route; none without points
  std::vector<GateResult> gates;     ///< for each route, each gate

  /// Share of the wide-area map's points that the mean region map leaves out.
  [[nodiscard]] double reduction() const;
  /// Whether every gate holds; no value without gates.
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
  bool opponents = true;
  /// Called before each run with a description of it. The run reports its progress to the result.
  std::function<ScanProgress(const std::string&)> progress = {};
};

/// Localizes every route in the region maps of every configuration, and in those of its opponents.
/// Gates are not judged yet.
/// Precondition: every route has a reference.
/// Errors: what localize_scans reports; a damaged wide-area map. If the wide-area map is missing,
/// EvaluatedConfig::no_opponents says so.
[[nodiscard]] Result<Evaluation> evaluate(const std::vector<NamedConfig>& configs,
                                          const std::vector<NamedInputs>& routes,
                                          const EvaluationOptions& options);

/// The only configuration whose map is the whole wide-area map in one piece; nullptr if there is
/// none, or more than one.
[[nodiscard]] const EvaluatedConfig* wide_area_config(const Evaluation& evaluation);

}  // namespace vantage
