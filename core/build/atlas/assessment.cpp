#include "vantage/build/assessment.hpp"

#include <limits>
#include <mutex>
#include <utility>
#include <vector>

#include "build/atlas/site_trials.hpp"
#include "build/atlas/sites.hpp"
#include "build/atlas/virtual_lidar.hpp"
#include "bundle/built_as_asked.hpp"
#include "bundle/find_store.hpp"
#include "localize/place_index.hpp"
#include "vantage/kit/map_in_memory.hpp"
#include "vantage/kit/stopwatch.hpp"

namespace vantage {
namespace {

/// The places that sites are chosen among, by RegionId.
Result<std::vector<PointCloud>> viewpoints_of(const Bundle& bundle) {
  const RegionDirectory& directory = *bundle.directory();
  std::vector<PointCloud> viewpoints(directory.summary().regions);
  for (std::uint32_t r = 0; r < viewpoints.size(); ++r) {
    VANTAGE_TRY(const DirectoryEntry entry, directory.entry(RegionId{r}));
    if (entry.summary.viewpoints == 0) continue;
    VANTAGE_TRY(RegionMap map, bundle.get(RegionId{r}));
    viewpoints[r] = std::move(map.viewpoints);
  }
  return viewpoints;
}

}  // namespace

Result<Assessment> Assessment::prepare(Bundle bundle, const Config& config,
                                       const PluginLoader& plugins) {
  VANTAGE_TRY(const PluginChoice choice, config.need(config.matcher, "matcher", "an assessment"));
  VANTAGE_TRY(auto matcher, plugins.load<ScanMatcher>(choice));
  VANTAGE_TRY(MatcherChoice named, MatcherChoice::of(choice, plugins));
  VANTAGE_CHECK(check_prepared_for(bundle, *matcher));
  VANTAGE_TRY(const auto relocalizer, relocalizer_for(bundle, config, plugins));
  VANTAGE_TRY(auto places, open_index(bundle, relocalizer));
  const auto& built = bundle.built_with();
  const auto& visibility = built && built->visibility ? built->visibility : config.visibility;
  const auto max_range = visibility ? visibility->max_range : std::nullopt;
  return Assessment(std::move(bundle), std::move(matcher), std::move(named), std::move(places),
                    config.atlas.value_or(AtlasParams{}),
                    max_range.value_or(std::numeric_limits<double>::infinity()));
}

Assessment::Assessment(Bundle bundle, PluginPtr<ScanMatcher> matcher, MatcherChoice choice,
                       PluginPtr<RelocalizerIndex> places, const AtlasParams& params,
                       double max_range)
    : bundle_(std::move(bundle)),
      matcher_(std::move(matcher)),
      choice_(std::move(choice)),
      places_(std::move(places)),
      params_(params),
      max_range_(max_range) {}

Result<void> Assessment::check_map(std::uint64_t points, const Bounds3& bounds) const {
  const BundleSummary& summary = bundle_.directory()->summary();
  const auto is_near = [](const Point& a, const Point& b) { return (a - b).norm() < 1e-3; };
  if (points == summary.map_points && is_near(bounds.min, summary.map_bounds.min) &&
      is_near(bounds.max, summary.map_bounds.max)) {
    return {};
  }
  return fail(ErrorCode::invalid_input,
              "the bundle was built of another map, of " + std::to_string(summary.map_points) +
                  " points and not " + std::to_string(points) +
                  ": expected the map that it was built of",
              SourceLocation{bundle_.name(), 0, 0});
}

Result<AssessmentReport> Assessment::run(PointsView map, const Progress& progress) {
  VANTAGE_CHECK(check_points(map, "the map"));
  return run(MapInMemory(map), progress);
}

Result<AssessmentReport> Assessment::run(const MapParts& map, const Progress& progress) {
  VANTAGE_CHECK(check_map(map.points(), map.bounds()));
  const HitsAt hits_at = hits_in(map, max_range_);
  const Stopwatch stopwatch;
  const CpuStopwatch cpu;
  VANTAGE_TRY(const auto viewpoints, viewpoints_of(bundle_));
  const auto sites = spread_sites(viewpoints, params_.site_spacing, params_.max_sites);
  std::mutex mutex;
  std::size_t done = 0;
  const auto tell = [&] {
    if (progress) progress(done, 2 * sites.size());
  };
  const auto step = [&] {
    const std::scoped_lock lock(mutex);
    ++done;
    tell();
  };
  tell();
  AssessmentReport report;
  VANTAGE_TRY(report.atlas, try_sites(bundle_, sites, hits_at, places_.get(), matcher_, step));
  report.atlas.matcher = choice_;
  VANTAGE_CHECK(bundle_.reader().attach(Atlas::kAttachment, report.atlas.encode()));
  report.seconds = stopwatch.seconds();
  report.core_seconds = cpu.seconds();
  return report;
}

double Assessment::reach() const noexcept { return reach_of_hits(max_range_); }

}  // namespace vantage
