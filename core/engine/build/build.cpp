#include "vantage/engine/build.hpp"

#include <optional>
#include <utility>

#include "build/condense.hpp"
#include "build/cut.hpp"
#include "build/places.hpp"
#include "build/regions.hpp"
#include "build/sight.hpp"
#include "build/survey.hpp"
#include "places/place_index.hpp"
#include "stopwatch.hpp"

namespace vantage {
namespace {

BuildReport counted(BuildReport report, const Places& places, const Cut& cut) {
  report.ground_points = places.ground_points;
  report.unreachable_viewpoints = places.unreachable_viewpoints;
  report.places_outside = cut.places_outside;
  for (const PointCloud& viewpoints : cut.viewpoints) {
    report.viewpoints += viewpoints.size();
    if (viewpoints.empty()) ++report.regions_without_viewpoints;
  }
  return report;
}

}  // namespace

Result<BuildReport> build_region_maps(PointsView map, PointsView trajectory, BuildPlugins& plugins,
                                      const BuildParams& params,
                                      const std::function<void(const BuildProgress&)>& progress) {
  VANTAGE_CHECK(check_points(map, "the map"));  // P of Eq. 1
  BuildReport report;
  report.map_points = map.size();

  // Ground (Sec. 2.2), or the driven path.
  Stopwatch stopwatch;
  VANTAGE_TRY(std::optional<Places> places,
              places_of(map, trajectory, plugins.ground.get(), params.viewpoints));
  report.seconds_ground = stopwatch.seconds();

  // Partition (Sec. 2.1, Eqs. 2-3) and viewpoints (Sec. 2.2, Eqs. 4-5).
  stopwatch = {};
  Sight sight(map, plugins.visibility, params);
  VANTAGE_TRY(report.partition, plugins.partitioner->partition(
                                    map, trajectory, BuildSurvey(map, *places, sight, params)));
  VANTAGE_TRY(const Cut regions, cut(map, *places, report.partition, params));
  report = counted(std::move(report), *places, regions);
  places.reset();
  report.seconds_partition = stopwatch.seconds();

  // Visibility (Sec. 2.3, Eqs. 6-10), condensed and stored region by region.
  stopwatch = {};
  const CpuStopwatch cpu;
  VANTAGE_TRY(const Condenser condenser, Condenser::over(map, plugins, params));
  VANTAGE_CHECK(plugins.store->begin(MapIndex{.partition = report.partition,
                                              .regions = {},
                                              .map_bounds = sight.limits().map_bounds,
                                              .map_points = report.map_points,
                                              .config = params.effective_config}));
  VANTAGE_TRY(report, build_regions(map, sight, regions, condenser, *plugins.store,
                                    std::move(report), progress));
  // What a search needs is kept beside the regions, by a store that can. A map that is too large
  // for one index is built without it.
  if (const auto index = PlaceIndex::of(map)) {
    const auto attached = plugins.store->attach(PlaceIndex::kAttachment, index->encode());
    if (!attached && attached.error().code != ErrorCode::unsupported) {
      return fail(attached.error());
    }
  }
  VANTAGE_CHECK(plugins.store->commit());
  report.seconds_visibility = stopwatch.seconds();
  report.core_seconds_visibility = cpu.seconds();
  return report;
}

}  // namespace vantage
