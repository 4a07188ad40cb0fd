#include "vantage/engine/build.hpp"

#include <algorithm>
#include <cstddef>
#include <optional>
#include <string_view>
#include <utility>
#include <vector>

#include "atlas/site_trials.hpp"
#include "atlas/sites.hpp"
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

/// Whether the store can keep attachments; it then keeps this one.
Result<bool> keep_attachment(MapStore& store, std::string_view name,
                             const std::vector<std::byte>& bytes) {
  const auto attached = store.attach(name, bytes);
  if (!attached && attached.error().code != ErrorCode::unsupported) return fail(attached.error());
  return attached.has_value();
}

/// Keeps the index of places, which a search needs, beside the regions. Makes ready what measures
/// the atlas, if it is wanted and the store can keep it. A map that is too large for one index is
/// built without it.
Result<std::optional<SiteTrials>> keep_places(PointsView map, const Partition& partition,
                                              const Cut& regions, const BuildPlugins& plugins,
                                              const BuildParams& params) {
  // A site costs less than a fifth of the visibility of so many viewpoints.
  constexpr std::size_t kViewpointsASite = 20;
  const auto places = PlaceIndex::of(map);
  if (places) {
    VANTAGE_TRY(const bool kept,
                keep_attachment(*plugins.store, PlaceIndex::kAttachment, places->encode()));
    if (!kept) return std::optional<SiteTrials>();
  }
  if (!params.atlas || !plugins.matcher) return std::optional<SiteTrials>();
  std::size_t viewpoints = 0;
  for (const PointCloud& of_region : regions.viewpoints) viewpoints += of_region.size();
  const auto most =
      std::min<std::size_t>(params.atlas->max_sites, viewpoints / kViewpointsASite + 1);
  return SiteTrials::prepare(map, partition,
                             spread_sites(regions.viewpoints, params.atlas->site_spacing, most),
                             places ? &*places : nullptr, params.max_range, plugins.matcher)
      .map([](SiteTrials&& trials) { return std::optional(std::move(trials)); });
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
  VANTAGE_TRY(std::optional<SiteTrials> trials,
              keep_places(map, report.partition, regions, plugins, params));
  VANTAGE_TRY(report, build_regions(map, sight, regions, condenser, *plugins.store,
                                    trials ? &*trials : nullptr, std::move(report), progress));
  if (trials) {
    const Atlas atlas = trials->atlas(plugins.matcher_choice);
    VANTAGE_CHECK(keep_attachment(*plugins.store, Atlas::kAttachment, atlas.encode()));
    report.atlas_sites = trials->sites();
    report.core_seconds_atlas = trials->core_seconds();
  }
  VANTAGE_CHECK(plugins.store->commit());
  report.seconds_visibility = stopwatch.seconds();
  report.core_seconds_visibility = std::max(0.0, cpu.seconds() - report.core_seconds_atlas);
  return report;
}

}  // namespace vantage
