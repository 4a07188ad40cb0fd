#include "build/bundle_writer.hpp"

#include <algorithm>
#include <string_view>
#include <vector>

namespace vantage {
namespace {

BuildReport report_of(const BuildPlan& plan) {
  BuildReport report;
  report.partition = plan.partition;
  report.map_points = plan.map_points;
  report.ground_points = plan.ground_points;
  report.unreachable_voxels = plan.unreachable_voxels;
  report.places_outside = plan.places_outside;
  report.seconds_ground = plan.seconds_ground;
  report.seconds_partition = plan.seconds_partition;
  for (const PointCloud& viewpoints : plan.viewpoints) {
    report.viewpoints += viewpoints.size();
    if (viewpoints.empty()) ++report.regions_without_viewpoints;
  }
  report.regions.assign(plan.partition.size(), {});
  report.seen.assign(plan.partition.size(), 0);
  return report;
}

/// Keeps an attachment, if the store can.
Result<void> keep_attachment(MapWriter& bundle, std::string_view name,
                             const std::vector<std::byte>& bytes) {
  auto attached = bundle.attach(name, bytes);
  if (!attached && attached.error().code == ErrorCode::unsupported) return {};
  return attached;
}

/// Viewpoints of some regions may be in the open. If all are, they are not where a sensor was.
Result<void> check_seen(const BuildReport& report) {
  const std::uint64_t blind = report.regions_that_see_nothing;
  if (blind == 0 || blind + report.regions_without_viewpoints < report.regions.size()) return {};
  return fail(ErrorCode::invalid_input,
              "no viewpoint sees a point of the map: look at viewpoints.sensor_height and "
              "visibility.max_range");
}

/// A block may be too sparse for the matcher, but not all that is seen.
Result<void> check_elements(const BuildReport& report, StoredContent content) {
  if (content == StoredContent::points) return {};
  const auto any = [&](auto counted) {
    return std::ranges::any_of(
        report.regions, [](auto count) { return count > 0; }, counted);
  };
  if (any(&RegionSummary::elements) || !any(&RegionSummary::points)) return {};
  return fail(ErrorCode::too_few_matches,
              "the map is too sparse: in no region can a scan be matched to what is seen");
}

}  // namespace

Result<BundleWriter> BundleWriter::begin(const BuildPlan& plan, const BuildPlugins& plugins,
                                         const BuildParams& params) {
  VANTAGE_TRY(auto begun, plugins.store->begin(MapIndex{.partition = plan.partition,
                                                        .regions = {},
                                                        .map_bounds = plan.limits.map_bounds,
                                                        .map_points = plan.map_points,
                                                        .config = params.effective_config}));
  BundleWriter writer(plan, params, in_library_of(plugins.store, std::move(begun)));
  writer.report_ = report_of(plan);
  if (plugins.selector) writer.predicted_.emplace().regions.resize(plan.partition.size());
  if (!plan.place_index.empty()) {
    VANTAGE_CHECK(keep_attachment(*writer.bundle_, Bundle::kPlaceIndex, plan.place_index));
  }
  return writer;
}

Result<void> BundleWriter::take(std::uint32_t region, PointsView map, BuiltRegion built) {
  const PointCloud& viewpoints = plan_->viewpoints[region];
  const bool own = params_->scope == VisibilityScope::region;
  const std::uint64_t among = own ? plan_->owned[region] : plan_->map_points;
  report_.seen[region] = built.seen;
  if (built.seen == 0 && !viewpoints.empty()) ++report_.regions_that_see_nothing;
  report_.skipped_viewpoints += built.skipped;
  report_.points_times_viewpoints +=
      static_cast<double>(viewpoints.size() - built.skipped) * static_cast<double>(among);
  report_.regions[region] = {
      .points = built.points, .viewpoints = viewpoints.size(), .elements = built.prepared.elements};
  if (predicted_) predicted_->regions[region] = std::move(built.errors);
  const RegionMap region_map = region_map_of(map, std::move(built), viewpoints);
  return bundle_->put(RegionId{region}, region_map);
}

Result<BuildReport> BundleWriter::commit() && {
  VANTAGE_CHECK(check_seen(report_));
  VANTAGE_CHECK(check_elements(report_, params_->content));
  if (predicted_) {
    VANTAGE_CHECK(keep_attachment(*bundle_, PredictedErrors::kAttachment, predicted_->encode()));
  }
  for (const auto& [name, bytes] : params_->attachments) {
    VANTAGE_CHECK(keep_attachment(*bundle_, name, bytes));
  }
  VANTAGE_CHECK(std::move(*bundle_).commit());
  return std::move(report_);
}

}  // namespace vantage
