#include "vantage/build.hpp"

#include <tbb/parallel_pipeline.h>
#include <tbb/task_arena.h>

#include <algorithm>
#include <atomic>
#include <optional>
#include "stopwatch.hpp"

namespace vantage {
namespace {

/// What one region needs from the map.
struct RegionWork {
  IndexList inside;       // P_ij of Eq. 3, only for VisibilityScope::region
  PointCloud viewpoints;  // Eq. 5
};

/// A plugin is not trusted to keep its promise about indices: a wrong one would read past the map.
Result<void> check_indices(const IndexList& indices, std::size_t size, const char* who) {
  for (std::size_t i = 0; i < indices.size(); ++i) {
    if (indices[i] >= size || (i > 0 && indices[i] <= indices[i - 1])) {
      return fail(ErrorCode::internal, std::string("the ") + who +
                                           " plugin broke its contract: its indices must ascend "
                                           "strictly and stay below " +
                                           std::to_string(size));
    }
  }
  return {};
}

/// V_ij, Eq. 10.
Result<RegionMap> observable_map(PointsView map, const RegionWork& work,
                                 const PluginPtr<VisibilityScene>& map_scene,
                                 const BuildPlugins& plugins, const VisibilityLimits& limits) {
  RegionMap region_map;
  region_map.viewpoints = static_cast<std::uint32_t>(work.viewpoints.size());
  if (work.viewpoints.empty()) return region_map;

  if (map_scene) {
    VANTAGE_TRY(const IndexList seen, map_scene->visible_from_any(work.viewpoints));
    VANTAGE_CHECK(check_indices(seen, map.size(), "visibility"));
    region_map.points = select(map, seen);
    return region_map;
  }
  const PointCloud inside = select(map, work.inside);
  VANTAGE_TRY(auto prepared, plugins.visibility->prepare(inside, limits));
  const auto scene = in_library_of(plugins.visibility, std::move(prepared));
  VANTAGE_TRY(const IndexList seen, scene->visible_from_any(work.viewpoints));
  VANTAGE_CHECK(check_indices(seen, inside.size(), "visibility"));
  region_map.points = select(inside, seen);
  return region_map;
}

}  // namespace

BuildParams BuildParams::from(const Config& config) {
  BuildParams params;
  params.viewpoints = config.viewpoints.value_or(ViewpointParams{});
  if (config.visibility) {
    params.scope = config.visibility->scope;
    params.max_range = config.visibility->max_range.value_or(params.max_range);
  }
  return params;
}

Result<BuildPlugins> load_build_plugins(const Config& config, const PluginLoader& loader) {
  constexpr std::string_view kJob = "building region maps";
  VANTAGE_TRY(const auto partitioner, config.need(config.partitioner, "partitioner", kJob));
  VANTAGE_TRY(const auto ground, config.need(config.ground, "ground", kJob));
  VANTAGE_TRY(const auto visibility, config.need(config.visibility, "visibility", kJob));
  VANTAGE_TRY(const auto store, config.need(config.store, "store", kJob));
  BuildPlugins plugins;
  VANTAGE_TRY(plugins.partitioner, loader.load<Partitioner>(partitioner));
  VANTAGE_TRY(plugins.ground, loader.load<GroundFilter>(ground));
  VANTAGE_TRY(plugins.visibility, loader.load<VisibilityOperator>(visibility.choice()));
  VANTAGE_TRY(plugins.store, loader.load<MapStore>(store));
  return plugins;
}

Result<BuildReport> build_region_maps(PointsView map, PointsView trajectory, BuildPlugins& plugins,
                                      const BuildParams& params,
                                      const std::function<void(const BuildProgress&)>& progress) {
  if (map.empty()) return fail(ErrorCode::invalid_input, "the map holds no points");
  if (map.size() > std::numeric_limits<std::uint32_t>::max()) {
    return fail(ErrorCode::invalid_input,
                "the map holds " + std::to_string(map.size()) +
                    " points, more than the 4,294,967,295 that can be indexed");
  }
  if (!all_finite(map)) return fail(ErrorCode::invalid_input, "the map holds a non-finite point");

  BuildReport report;
  report.map_points = map.size();
  const VisibilityLimits limits{.map_bounds = bounds_of(map), .max_range = params.max_range};

  Stopwatch stopwatch;
  VANTAGE_TRY(report.partition, plugins.partitioner->partition(map, trajectory));
  std::vector<std::uint32_t> region_of(map.size());
  std::vector<RegionWork> work(report.partition.size());
  for (std::size_t k = 0; k < map.size(); ++k) {
    const auto region = report.partition.locate(map[k]);
    if (!region) {
      return fail(ErrorCode::internal,
                  "the partitioner plugin broke its contract: no region owns map point " +
                      std::to_string(k));
    }
    region_of[k] = region->value;
    if (params.scope == VisibilityScope::region) {
      work[region->value].inside.push_back(static_cast<std::uint32_t>(k));
    }
  }
  report.seconds_partition = stopwatch.seconds();

  stopwatch = {};
  VANTAGE_TRY(const IndexList ground, plugins.ground->ground(map));
  VANTAGE_CHECK(check_indices(ground, map.size(), "ground"));
  if (ground.empty()) {
    return fail(ErrorCode::invalid_input,
                "no ground was found in the map, so there is nowhere to put a viewpoint");
  }
  report.ground_points = ground.size();
  {
    std::vector<PointCloud> ground_of(report.partition.size());  // g_ij
    for (const std::uint32_t k : ground) ground_of[region_of[k]].push_back(map[k]);
    for (std::size_t r = 0; r < work.size(); ++r) {
      VANTAGE_TRY(work[r].viewpoints, viewpoints_over(ground_of[r], params.viewpoints));
      report.viewpoints += work[r].viewpoints.size();
      if (work[r].viewpoints.empty()) ++report.regions_without_viewpoints;
    }
  }
  region_of = {};
  report.seconds_ground = stopwatch.seconds();

  stopwatch = {};
  PluginPtr<VisibilityScene> map_scene;
  if (params.scope == VisibilityScope::map) {
    VANTAGE_TRY(auto scene, plugins.visibility->prepare(map, limits));
    map_scene = in_library_of(plugins.visibility, std::move(scene));
  }
  VANTAGE_CHECK(plugins.store->begin(MapIndex{.partition = report.partition,
                                              .regions = {},
                                              .map_bounds = limits.map_bounds,
                                              .map_points = report.map_points,
                                              .config = params.effective_config}));

  // Regions in parallel, stored in order; the first failing region decides the error.
  report.regions.resize(work.size());
  BuildProgress done{.regions = work.size(), .viewpoints = report.viewpoints};
  if (progress) progress(done);
  Result<void> outcome{};
  std::atomic<bool> stop{false};
  std::uint32_t next = 0;
  struct Item {
    RegionId region;
    Result<RegionMap> map;
  };
  const auto tokens = static_cast<std::size_t>(tbb::this_task_arena::max_concurrency()) + 1;
  tbb::parallel_pipeline(
      tokens, tbb::make_filter<void, std::uint32_t>(tbb::filter_mode::serial_in_order,
                                                    [&](tbb::flow_control& flow) {
                                                      if (next == work.size() || stop) flow.stop();
                                                      return next++;
                                                    }) &
                  tbb::make_filter<std::uint32_t, std::shared_ptr<Item>>(
                      tbb::filter_mode::parallel,
                      [&](std::uint32_t r) {
                        return std::make_shared<Item>(Item{
                            RegionId{r}, observable_map(map, work[r], map_scene, plugins, limits)});
                      }) &
                  tbb::make_filter<std::shared_ptr<Item>, void>(
                      tbb::filter_mode::serial_in_order, [&](const std::shared_ptr<Item>& item) {
                        if (!outcome) return;
                        const std::uint32_t r = item->region.value;
                        if (item->map) {
                          outcome = plugins.store->put(item->region, *item->map);
                        } else {
                          outcome = fail(std::move(item->map).error());
                        }
                        if (!outcome) {
                          outcome = fail(std::move(outcome).error().during(
                              "building region '" + report.partition[item->region].label + "'"));
                          stop = true;
                          return;
                        }
                        report.regions[r] = {.points = item->map->points.size(),
                                             .viewpoints = item->map->viewpoints,
                                             .bytes = 0};
                        ++done.regions_done;
                        done.viewpoints_done += item->map->viewpoints;
                        if (progress) progress(done);
                      }));
  VANTAGE_CHECK(outcome);
  VANTAGE_CHECK(plugins.store->commit());
  report.seconds_visibility = stopwatch.seconds();
  return report;
}

}  // namespace vantage
