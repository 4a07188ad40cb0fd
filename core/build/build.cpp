#include "vantage/build/build.hpp"

#include <cstdint>
#include <limits>
#include <utility>

#include "build/bundle_writer.hpp"
#include "build/condense.hpp"
#include "build/plan.hpp"
#include "build/regions.hpp"
#include "build/sight.hpp"
#include "vantage/kit/map_in_memory.hpp"
#include "vantage/kit/stopwatch.hpp"

namespace vantage {

/// The map is a source with one block, and the bundle is the sink.
Result<BuildReport> build_region_maps(PointsView map, PointsView trajectory, BuildPlugins& plugins,
                                      const BuildParams& params,
                                      const std::function<void(const BuildProgress&)>& progress) {
  VANTAGE_CHECK(check_points(map, "the map"));  // P of Eq. 1
  const MapInMemory source(map);
  Sight sight(map, {.map_bounds = source.bounds(), .max_range = params.max_range},
              plugins.visibility, params);
  VANTAGE_TRY(const BuildPlan plan, plan_of(source, trajectory, plugins, params,
                                            std::numeric_limits<std::uint64_t>::max(), &sight));
  // Begins before the condenser, whose choice of elements is taken off again below.
  const Stopwatch stopwatch;
  const CpuStopwatch cpu;
  VANTAGE_TRY(const Condenser condenser,
              Condenser::over(map, plugins, params, Condenser::Sparse::refuse));
  VANTAGE_TRY(BundleWriter writer, BundleWriter::begin(plan, plugins, params));
  Meter meter(meter_start(plan), progress);
  VANTAGE_CHECK(build_block({every_region(plan.partition.size()), {}}, plan, params.scope, sight,
                            condenser, meter, [&](std::uint32_t region, BuiltRegion built) {
                              return writer.take(region, map, std::move(built));
                            }));
  VANTAGE_TRY(BuildReport report, std::move(writer).commit());
  report.core_seconds_selection = condenser.core_seconds_selection();
  report.seconds_visibility = stopwatch.seconds();
  report.core_seconds_visibility = cpu.seconds() - report.core_seconds_selection;
  return report;
}

}  // namespace vantage
