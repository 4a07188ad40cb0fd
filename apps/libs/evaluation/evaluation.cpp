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

constexpr double kOpponentSearch = 20.0;  // [m]

/// What every step with one configuration uses.
struct Job {
  const Config& config;
  const std::string& name;
  const std::vector<NamedInputs>& routes;
  const EvaluationOptions& options;
};

Result<RouteRun> run_route(const Job& job, Localizer localizer, const NamedInputs& route,
                           std::string_view map) {
  std::string label = job.name;
  if (job.routes.size() > 1) label += " on " + route.name;
  if (!map.empty()) label += ", " + std::string(map);
  const ScanProgress progress = job.options.progress ? job.options.progress(label) : ScanProgress();
  VANTAGE_TRY(Run run,
              localize_scans(std::move(localizer), job.config.file, route.inputs, progress));
  RunSummary summary = summarize(run);
  return RouteRun{std::move(run), std::move(summary)};
}

Result<Opponent> run_opponent(const Job& job, const OpponentMaps& maps, Thinning thinning) {
  Opponent opponent{.name = std::string(to_string(thinning)), .routes = {}};
  LocalizerParams params = job.config.localizer.value_or(LocalizerParams{});
  params.prefetch = false;  // choosing points in the background would disturb T_align
  // A search of the whole campus would first have to make the map of every region.
  params.recovery_radius =
      std::min(params.recovery_radius.value_or(kOpponentSearch), kOpponentSearch);
  for (const NamedInputs& route : job.routes) {
    VANTAGE_TRY(auto matcher, job.options.loader.load<ScanMatcher>(*job.config.matcher));
    VANTAGE_TRY(auto localizer,
                Localizer::open(PluginPtr<MapStore>(new OpponentStore(maps, thinning)),
                                std::move(matcher), params));
    VANTAGE_TRY(opponent.routes.emplace_back(),
                run_route(job, std::move(localizer), route, opponent.name));
  }
  return opponent;
}

/// Whether the map of every region driven through holds everything within reach.
Result<bool> leave_nothing_out(const std::vector<RouteRun>& routes, const OpponentMaps& maps) {
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

/// Runs the opponents, or says why some or all of them are missing.
Result<void> add_opponents(const Job& job, const MapStore& store, PointsView map,
                           EvaluatedConfig& evaluated) {
  if (evaluated.region_points.max == 0.0) {
    evaluated.no_opponents = "the bundle stores no points, so there is no number to be equal to";
    return {};
  }
  const OpponentMaps maps(store, evaluated.index, map,
                          job.config.visibility.value_or(VisibilityConfig{}));
  VANTAGE_TRY(const bool nothing, leave_nothing_out(evaluated.routes, maps));
  if (nothing) {
    evaluated.no_opponents = "its region maps hold every point within reach";
    return {};
  }
  for (const Thinning thinning : kThinnings) {
    auto opponent = run_opponent(job, maps, thinning);
    if (opponent) {
      evaluated.opponents.push_back(*std::move(opponent));
      continue;
    }
    // A map so thin that no scan can be matched against it is a result, not a failure.
    if (!evaluated.no_opponents.empty()) evaluated.no_opponents += "; ";
    evaluated.no_opponents +=
        std::string(to_string(thinning)) + " left out: " + opponent.error().message;
  }
  return {};
}

/// The map of the region at the middle of the first route, if it has points.
Result<std::optional<Specimen>> specimen_of(const MapStore& store,
                                            const std::vector<RouteRun>& routes) {
  const auto& scans = routes.front().run.scans;
  if (scans.empty()) return std::nullopt;
  const RegionId region = scans[scans.size() / 2].report.region;
  VANTAGE_TRY(RegionMap map, store.get(region));
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
    map.missing = "the wide-area map is not at hand: " + cloud.error().message;
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
  VANTAGE_TRY(const StoreConfig choice, config.need(config.store, "store", "evaluating"));
  VANTAGE_TRY(const PluginPtr<MapStore> store, options.loader.load<MapStore>(choice.choice()));
  VANTAGE_TRY(evaluated.index, store->index());
  std::vector<double> points;
  for (const RegionSummary& region : evaluated.index.regions) {
    points.push_back(static_cast<double>(region.points));
    evaluated.bundle_bytes += region.bytes;
  }
  evaluated.region_points = statistics_of(points);
  for (const NamedInputs& route : routes) {
    VANTAGE_TRY(auto localizer, Localizer::open(config, options.loader));
    VANTAGE_TRY(evaluated.routes.emplace_back(), run_route(job, std::move(localizer), route, ""));
  }
  VANTAGE_TRY(evaluated.specimen, specimen_of(*store, evaluated.routes));
  if (!options.opponents) {
    evaluated.no_opponents = "they were not asked for";
  } else if (!map.missing.empty()) {
    evaluated.no_opponents = map.missing;
  } else {
    VANTAGE_CHECK(add_opponents(job, *store, map.points, evaluated));
  }
  return evaluated;
}

}  // namespace

double EvaluatedConfig::reduction() const {
  if (index.map_points == 0) return 0.0;
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
