#include "vantage/evaluation/evaluation.hpp"

#include <algorithm>
#include <cmath>
#include <set>

#include "vantage/evaluation/baselines.hpp"
#include "vantage/io/map_files.hpp"
#include "vantage/io/point_cloud_io.hpp"

namespace vantage {
namespace {

namespace fs = std::filesystem;

constexpr double kBaselineSearch = 20.0;  // [m]

/// What every step with one configuration uses.
struct Job {
  const Config& config;
  const std::string& name;
  const std::vector<NamedInputs>& routes;
  const EvaluationOptions& options;
};

/// @param predicted  of the bundle; none for a baseline
Result<RouteRun> run_route(const Job& job, Localizer localizer, const NamedInputs& route,
                           std::string_view map,
                           const std::optional<PredictedErrors>& predicted = {}) {
  std::string label = job.name;
  if (job.routes.size() > 1) label += " on " + route.name;
  if (!map.empty()) label += ", " + std::string(map);
  const ScanProgress progress = job.options.progress ? job.options.progress(label) : ScanProgress();
  VANTAGE_TRY(Run run,
              localize_scans(std::move(localizer), job.config.file, route.inputs, progress));
  if (run.failure) return fail(*std::move(run.failure));  // half a run compares with nothing
  if (predicted) {
    for (RunScan& scan : run.scans) predict(scan, *predicted);
  }
  RunSummary summary = summarize(run);
  return RouteRun{std::move(run), std::move(summary)};
}

Result<Baseline> run_baseline(const Job& job, const BaselineMaps& maps, Thinning thinning) {
  Baseline baseline{.name = std::string(to_string(thinning)), .routes = {}};
  Config config = job.config;
  LocalizerParams& params = config.localizer ? *config.localizer : config.localizer.emplace();
  params.prefetch = false;  // choosing points in the background would disturb T_align
  // A search of the whole campus would first have to make the map of every region.
  params.recovery_radius =
      std::min(params.recovery_radius.value_or(kBaselineSearch), kBaselineSearch);
  for (const NamedInputs& route : job.routes) {
    VANTAGE_TRY(
        Bundle bundle,
        Bundle::of(PluginPtr<const MapReader>(new BaselineReader(maps, thinning)), baseline.name));
    VANTAGE_TRY(auto localizer, Localizer::open(std::move(bundle), config, job.options.loader));
    VANTAGE_TRY(baseline.routes.emplace_back(),
                run_route(job, std::move(localizer), route, baseline.name));
  }
  return baseline;
}

/// Whether no region that was driven through leaves out anything within reach.
Result<bool> leave_nothing_out(const std::vector<RouteRun>& routes, const BaselineMaps& maps) {
  std::set<std::uint32_t> driven;
  for (const RouteRun& route : routes) {
    for (const RunScan& scan : route.run.scans) driven.insert(scan.report.region.value);
  }
  for (const std::uint32_t region : driven) {
    VANTAGE_TRY(const bool everything, maps.holds_everything(RegionId{region}));
    if (!everything) return false;
  }
  return true;
}

/// Runs the baselines, or says why some or all are missing.
Result<void> add_baselines(const Job& job, const Bundle& bundle, PointsView map,
                           EvaluatedConfig& evaluated) {
  if (!stores_points(evaluated.index)) {
    evaluated.no_baselines =
        "the bundle stores no points, so baselines have no number of points to match";
    return {};
  }
  // What the configuration leaves out, the bundle knows.
  const Config& built_with = bundle.built_with() ? *bundle.built_with() : job.config;
  const BaselineMaps maps(bundle.reader(), evaluated.index, map,
                          built_with.visibility.value_or(VisibilityConfig{}));
  VANTAGE_TRY(const bool nothing, leave_nothing_out(evaluated.routes, maps));
  if (nothing) {
    evaluated.no_baselines = "its region maps hold every point within reach";
    return {};
  }
  for (const Thinning thinning : kThinnings) {
    auto baseline = run_baseline(job, maps, thinning);
    if (baseline) {
      evaluated.baselines.push_back(*std::move(baseline));
      continue;
    }
    // A map so thin that no scan can be matched against it is a result, not a failure.
    if (!evaluated.no_baselines.empty()) evaluated.no_baselines += "; ";
    evaluated.no_baselines +=
        std::string(to_string(thinning)) + " left out: " + baseline.error().message;
  }
  return {};
}

/// The region map where the first route is halfway, if it has points.
Result<std::optional<Specimen>> specimen_of(const Bundle& bundle,
                                            const std::vector<RouteRun>& routes) {
  const auto& scans = routes.front().run.scans;
  if (scans.empty()) return std::nullopt;
  const RegionId region = scans[scans.size() / 2].report.region;
  VANTAGE_TRY(RegionMap map, bundle.get(region));
  if (map.points.empty()) return std::nullopt;
  return Specimen{region, std::move(map.points), std::move(map.viewpoints)};
}

/// As the configuration names them: files, folders and patterns.
std::vector<fs::path> map_sources(const Config& config) {
  std::vector<fs::path> sources;
  if (!config.map) return sources;
  for (const fs::path& source : config.map->files) {
    sources.push_back(fs::absolute(source).lexically_normal());
  }
  return sources;
}

/// A wide-area map and its source.
struct WideAreaMap {
  std::vector<fs::path> sources;
  PointCloud points;
  std::string missing;  // why there are no points
};

/// A missing map is reported but is not an error, so that a robot that has only the bundles can be
/// evaluated.
Result<WideAreaMap> read_map(const Config& config) {
  WideAreaMap map{.sources = map_sources(config), .points = {}, .missing = {}};
  if (map.sources.empty()) {
    map.missing = "the configuration names no wide-area map";
    return map;
  }
  auto cloud = io::map_files(map.sources).and_then([](const io::MapFiles& found) {
    return io::read_point_clouds(found.files);
  });
  if (!cloud && cloud.error().code == ErrorCode::not_found) {
    map.missing = "the wide-area map is not available: " + cloud.error().message;
    return map;
  }
  if (!cloud) return fail(std::move(cloud).error());
  map.points = std::move(cloud->points);
  return map;
}

Result<EvaluatedConfig> evaluate(const Config& config, const std::string& name,
                                 const std::vector<NamedInputs>& routes, const WideAreaMap& map,
                                 const EvaluationOptions& options) {
  const Job job{config, name, routes, options};
  EvaluatedConfig evaluated;
  evaluated.name = name;
  VANTAGE_TRY(const Bundle bundle, Bundle::open(config, options.loader, "evaluating"));
  VANTAGE_TRY(const auto index, bundle.index());
  evaluated.index = *index;
  evaluated.bundle_bytes = bundle.bytes();
  VANTAGE_TRY(evaluated.atlas, Atlas::of_bundle(bundle));
  std::vector<double> points;
  for (const RegionSummary& region : evaluated.index.regions) {
    if (stores_points(evaluated.index)) points.push_back(static_cast<double>(region.points));
  }
  evaluated.region_points = statistics_of(points);
  VANTAGE_TRY(const auto predicted, PredictedErrors::of_bundle(bundle));
  for (const NamedInputs& route : routes) {
    VANTAGE_TRY(auto localizer, Localizer::open(bundle, config, options.loader));
    VANTAGE_TRY(evaluated.routes.emplace_back(),
                run_route(job, std::move(localizer), route, "", predicted));
  }
  VANTAGE_TRY(evaluated.specimen, specimen_of(bundle, evaluated.routes));
  if (!options.baselines) {
    evaluated.no_baselines = "they were not asked for";
  } else if (!map.missing.empty()) {
    evaluated.no_baselines = map.missing;
  } else {
    VANTAGE_CHECK(add_baselines(job, bundle, map.points, evaluated));
  }
  return evaluated;
}

}  // namespace

bool stores_points(const MapIndex& index) {
  return std::any_of(index.regions.begin(), index.regions.end(),
                     [](const RegionSummary& region) { return region.points > 0; });
}

std::optional<double> EvaluatedConfig::reduction() const {
  if (index.map_points == 0 || !stores_points(index)) return {};
  return 1.0 - region_points.mean / static_cast<double>(index.map_points);
}

std::optional<bool> EvaluatedConfig::passed() const {
  if (gates.empty()) return {};
  return std::all_of(gates.begin(), gates.end(), [](const GateResult& g) { return g.holds; });
}

Result<Evaluation> evaluate(const std::vector<NamedConfig>& configs,
                            const std::vector<NamedInputs>& routes,
                            const EvaluationOptions& options) {
  Evaluation evaluation;
  for (const NamedInputs& route : routes) {
    evaluation.routes.push_back({route.name, *route.inputs.reference});
  }
  std::optional<WideAreaMap> map;
  for (const NamedConfig& entry : configs) {
    const auto during = [&](Error error) {
      return fail(std::move(error).during("evaluating " + entry.config.file));
    };
    if (!map || map->sources != map_sources(entry.config)) {
      auto read = read_map(entry.config);
      if (!read) return during(std::move(read).error());
      // The report shows the first map.
      if (map && evaluation.map.empty()) evaluation.map = std::move(map->points);
      map = *std::move(read);
    }
    auto evaluated = evaluate(entry.config, entry.name, routes, *map, options);
    if (!evaluated) return during(std::move(evaluated).error());
    evaluation.configs.push_back(*std::move(evaluated));
  }
  if (map && evaluation.map.empty()) evaluation.map = std::move(map->points);
  return evaluation;
}

const EvaluatedConfig* wide_area_config(const Evaluation& evaluation) {
  const EvaluatedConfig* found = nullptr;
  for (const EvaluatedConfig& config : evaluation.configs) {
    const bool whole = config.index.partition.size() == 1 &&
                       config.index.regions.front().points == config.index.map_points;
    if (!whole) continue;
    if (found) return nullptr;  // several, so there is no single one
    found = &config;
  }
  return found;
}

}  // namespace vantage
