#include "build/bundle_writer.hpp"

#include <algorithm>
#include <cstddef>
#include <string_view>
#include <vector>

#include "atlas/sites.hpp"
#include "localize/place_index.hpp"

namespace vantage {
namespace {

BuildReport report_of(const BuildPlan& plan) {
  BuildReport report;
  report.partition = plan.partition;
  report.map_points = plan.map_points;
  report.ground_points = plan.ground_points;
  report.unreachable_viewpoints = plan.unreachable_viewpoints;
  report.places_outside = plan.places_outside;
  for (const PointCloud& viewpoints : plan.viewpoints) {
    report.viewpoints += viewpoints.size();
    if (viewpoints.empty()) ++report.regions_without_viewpoints;
  }
  report.regions.assign(plan.partition.size(), {});
  report.seen.assign(plan.partition.size(), 0);
  return report;
}

/// Whether the store can keep attachments; it then keeps this one.
Result<bool> keep_attachment(MapStore& store, std::string_view name,
                             const std::vector<std::byte>& bytes) {
  const auto attached = store.attach(name, bytes);
  if (!attached && attached.error().code != ErrorCode::unsupported) return fail(attached.error());
  return attached.has_value();
}

}  // namespace

Result<BundleWriter> BundleWriter::begin(const BuildPlan& plan, BuildPlugins& plugins,
                                         const BuildParams& params, const HitsAt& hits_at) {
  BundleWriter writer(plan, plugins);
  writer.attachments_ = &params.attachments;
  writer.report_ = report_of(plan);
  if (plugins.selector) writer.predicted_.emplace().regions.resize(plan.partition.size());
  VANTAGE_CHECK(plugins.store->begin(MapIndex{.partition = plan.partition,
                                              .regions = {},
                                              .map_bounds = plan.limits.map_bounds,
                                              .map_points = plan.map_points,
                                              .config = params.effective_config}));
  VANTAGE_CHECK(writer.prepare_atlas(params, hits_at));
  return writer;
}

Result<void> BundleWriter::prepare_atlas(const BuildParams& params, const HitsAt& hits_at) {
  // A site costs less than a fifth of the visibility of so many viewpoints.
  constexpr std::size_t kViewpointsASite = 20;
  if (!plan_->place_index.empty()) {
    VANTAGE_TRY(const bool kept,
                keep_attachment(*plugins_->store, Bundle::kPlaceIndex, plan_->place_index));
    if (!kept) return {};
  }
  if (!params.atlas || !plugins_->matcher) return {};
  PluginPtr<RelocalizerIndex> places;
  if (!plan_->place_index.empty()) {
    VANTAGE_TRY(places, open_index(plugins_->relocalizer, plan_->place_index));
  }
  const auto most =
      std::min<std::size_t>(params.atlas->max_sites, report_.viewpoints / kViewpointsASite + 1);
  const auto sites = spread_sites(plan_->viewpoints, params.atlas->site_spacing, most);
  VANTAGE_TRY(SiteTrials trials, SiteTrials::prepare(plan_->partition, sites, hits_at, places.get(),
                                                     plugins_->matcher));
  trials_.emplace(std::move(trials));
  return {};
}

Result<void> BundleWriter::take(std::uint32_t region, PointsView map, Finished finished,
                                std::uint64_t among) {
  const PointCloud& viewpoints = plan_->viewpoints[region];
  report_.seen[region] = finished.seen;
  report_.skipped_viewpoints += finished.skipped;
  report_.points_times_viewpoints +=
      static_cast<double>(viewpoints.size() - finished.skipped) * static_cast<double>(among);
  report_.regions[region] = {.points = finished.points,
                             .viewpoints = viewpoints.size(),
                             .elements = finished.prepared.elements};
  if (predicted_) predicted_->regions[region] = std::move(finished.errors);
  const RegionMap region_map = region_map_of(map, std::move(finished), viewpoints);
  VANTAGE_CHECK(plugins_->store->put(RegionId{region}, region_map));
  if (trials_) VANTAGE_CHECK(trials_->run_in(RegionId{region}, region_map));
  return {};
}

Result<BuildReport> BundleWriter::commit() && {
  if (trials_) {
    const Atlas atlas = trials_->atlas(plugins_->matcher_choice);
    VANTAGE_CHECK(keep_attachment(*plugins_->store, Atlas::kAttachment, atlas.encode()));
    report_.atlas_sites = trials_->sites();
    report_.core_seconds_atlas = trials_->core_seconds();
  }
  if (predicted_) {
    VANTAGE_CHECK(
        keep_attachment(*plugins_->store, PredictedErrors::kAttachment, predicted_->encode()));
  }
  for (const auto& [name, bytes] : *attachments_) {
    VANTAGE_CHECK(keep_attachment(*plugins_->store, name, bytes));
  }
  VANTAGE_CHECK(plugins_->store->commit());
  report_.seconds_visibility = stopwatch_.seconds();
  report_.core_seconds_visibility = std::max(0.0, cpu_.seconds() - report_.core_seconds_atlas);
  return std::move(report_);
}

}  // namespace vantage
