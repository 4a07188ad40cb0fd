#include "vantage/engine/build.hpp"

#include <cstdint>
#include <numeric>
#include <optional>
#include <utility>
#include <vector>

#include "build/bundle_writer.hpp"
#include "build/condense.hpp"
#include "build/cut.hpp"
#include "build/places.hpp"
#include "build/plan.hpp"
#include "build/regions.hpp"
#include "build/sight.hpp"
#include "build/survey.hpp"
#include "stopwatch.hpp"
#include "vantage/kit/map_in_memory.hpp"

namespace vantage {
Result<BuildReport> build_region_maps(PointsView map, PointsView trajectory, BuildPlugins& plugins,
                                      const BuildParams& params,
                                      const std::function<void(const BuildProgress&)>& progress) {
  VANTAGE_CHECK(check_points(map, "the map"));  // P of Eq. 1
  BuildPlan plan;
  plan.map_points = map.size();
  plan.limits = {.map_bounds = bounds_of(map), .max_range = params.max_range};

  // Ground (Sec. 2.2), or the driven path.
  Stopwatch stopwatch;
  VANTAGE_TRY(std::optional<Places> places,
              places_of(map, trajectory, plugins.ground.get(), params.outliers, params.viewpoints));
  plan.ground_points = places->ground_points;
  plan.unreachable_viewpoints = places->unreachable_viewpoints;
  const double seconds_ground = stopwatch.seconds();

  // Partition (Sec. 2.1, Eqs. 2-3) and viewpoints (Sec. 2.2, Eqs. 4-5).
  stopwatch = {};
  Sight sight(map, plan.limits, plugins.visibility, params);
  VANTAGE_TRY(plan.partition, plugins.partitioner->partition(
                                  map, trajectory, BuildSurvey(map, *places, sight, params)));
  VANTAGE_TRY(Cut regions, cut(map, *places, plan.partition, params));
  plan.viewpoints = std::move(regions.viewpoints);
  plan.places_outside = regions.places_outside;
  places.reset();
  const double seconds_partition = stopwatch.seconds();

  // Visibility (Sec. 2.3, Eqs. 6-10), condensed and stored region by region.
  VANTAGE_TRY(const Condenser condenser, Condenser::over(map, plugins, params));
  VANTAGE_TRY(plan.place_index, place_index_of(MapInMemory(map), plugins));
  VANTAGE_TRY(BundleWriter writer, BundleWriter::begin(plan, plugins, params));
  std::vector<std::uint32_t> all(plan.partition.size());
  std::iota(all.begin(), all.end(), 0U);
  Meter meter(meter_start(plan), progress);
  VANTAGE_CHECK(
      build_regions({all, plan.viewpoints, regions.inside}, plan.partition, sight, condenser, meter,
                    [&](std::uint32_t region, Condensed condensed) -> Result<void> {
                      VANTAGE_TRY(Finished finished, condenser.finish(std::move(condensed)));
                      const bool own = params.scope == VisibilityScope::region;
                      return writer.take(region, map, std::move(finished),
                                         own ? regions.inside[region].size() : map.size());
                    }));
  VANTAGE_TRY(BuildReport report, std::move(writer).commit());
  report.core_seconds_selection = condenser.core_seconds_selection();
  report.core_seconds_visibility -= report.core_seconds_selection;
  report.seconds_ground = seconds_ground;
  report.seconds_partition = seconds_partition;
  return report;
}

}  // namespace vantage
