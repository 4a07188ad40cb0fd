// vantage-build: makes a bundle of region maps from a wide-area map and a configuration.
#include <fmt/format.h>
#include <sys/resource.h>

#include <iostream>
#include <nlohmann/json.hpp>
#include <optional>

#include "print_config.hpp"
#include "terminal/command_line.hpp"
#include "terminal/progress.hpp"
#include "terminal/table.hpp"
#include "vantage/engine/bundle_build.hpp"
#include "vantage/evaluation/statistics.hpp"
#include "vantage/io/map_files.hpp"
#include "vantage/io/point_cloud_io.hpp"
#include "vantage/io/trajectory_io.hpp"

namespace vantage {
namespace {

struct Options {
  std::string config;
  bool print_config = false;
  std::optional<std::uint32_t> min_views;
  cli::CommonOptions common;
};

struct WideAreaMap {
  PointCloud points;
  std::uint64_t dropped = 0;
  std::uint64_t unlisted_tiles = 0;
  PointCloud trajectory;
};

Result<WideAreaMap> read_map(const MapSource& source) {
  WideAreaMap map;
  VANTAGE_TRY(const io::MapFiles found, io::map_files(source.files));
  VANTAGE_TRY(auto cloud, io::read_point_clouds(found.files));
  map.points = std::move(cloud.points);
  map.dropped = cloud.dropped;
  map.unlisted_tiles = found.unlisted_tiles;
  if (map.points.empty()) {
    return fail(ErrorCode::invalid_input,
                "the map holds no finite point (" + std::to_string(map.dropped) + " dropped)",
                SourceLocation{source.files.front().string(), 0, 0});
  }
  if (source.trajectory) {
    VANTAGE_TRY(const auto trajectory, io::read_trajectory(*source.trajectory));
    for (const auto& moment : trajectory) map.trajectory.push_back(moment.pose.translation);
  }
  return map;
}

/// The largest amount of memory that the process has used [bytes].
std::uint64_t peak_memory() {
  rusage usage{};
  ::getrusage(RUSAGE_SELF, &usage);
  return 1024 * static_cast<std::uint64_t>(usage.ru_maxrss);
}

void print_report(const BuildReport& report, const MapIndex& index, const WideAreaMap& map,
                  const cli::Style& style) {
  std::vector<double> seen(report.seen.begin(), report.seen.end()), kept;
  std::uint64_t bytes = 0;
  std::uint64_t elements = 0;
  for (std::size_t r = 0; r < index.regions.size(); ++r) {
    kept.push_back(static_cast<double>(report.regions[r].points));
    elements += index.regions[r].elements;
    bytes += index.regions[r].bytes;
  }

  cli::TextTable table(
      {"", "regions", "points (mean)", "min", "max", "std", "reduction [%]", "size [MB]"});
  table.add({"wide-area map", "1", cli::grouped(report.map_points), "", "", "", "", ""});
  const auto add = [&](const std::string& name, const std::vector<double>& points,
                       const std::string& size) {
    const Statistics s = statistics_of(points);
    const auto count = [](double x) { return cli::grouped(static_cast<std::uint64_t>(x + 0.5)); };
    const double reduction = 100.0 * (1.0 - s.mean / static_cast<double>(report.map_points));
    table.add({name, cli::grouped(points.size()), count(s.mean), count(s.min), count(s.max),
               count(s.std), fmt::format("{:.1f}", reduction), size});
  };
  if (seen != kept) add("seen", seen, "");  // min_views and thinning have left some points out
  add("region maps", kept, fmt::format("{:.1f}", static_cast<double>(bytes) / 1e6));
  std::cout << table.to_string(style);
  std::cout << fmt::format(
      "\n{}{} viewpoints; partition {:.2f} s, ground {:.2f} s, visibility {:.2f} "
      "s\n",
      report.ground_points > 0 ? cli::grouped(report.ground_points) + " ground points, " : "",
      cli::grouped(report.viewpoints), report.seconds_partition, report.seconds_ground,
      report.seconds_visibility);
  std::cout << fmt::format(
      "{:.1f} core-seconds for visibility, {:.3g} for each viewpoint and million points; peak "
      "memory {} MB\n",
      report.core_seconds_visibility, report.core_seconds_a_viewpoint_and_million_points(),
      cli::grouped((peak_memory() + 500'000) / 1'000'000));
  if (report.atlas_sites > 0) {
    std::cout << fmt::format(
        "{} of the viewpoints are sites of the atlas: {:.1f} core-seconds for virtual scans\n",
        cli::grouped(report.atlas_sites), report.core_seconds_atlas);
  }
  if (elements > 0) {
    std::cout << fmt::format("prepared maps are stored: {} elements of the matcher\n",
                             cli::grouped(elements));
  }
  if (map.dropped > 0) {
    std::cout << fmt::format("{} map points with NaN or infinite coordinates were dropped\n",
                             cli::grouped(map.dropped));
  }
  if (map.unlisted_tiles > 0) {
    std::cout << fmt::format(
        "{} files beside the map's tiles are not in the tiles' metadata and "
        "were left out\n",
        cli::grouped(map.unlisted_tiles));
  }
  if (report.skipped_viewpoints > 0) {
    std::cout << fmt::format("{} of the viewpoints would show too little new and were skipped\n",
                             cli::grouped(report.skipped_viewpoints));
  }
  if (report.unreachable_viewpoints > 0) {
    std::cout << fmt::format("{} viewpoints over ground that is not reachable were left out\n",
                             cli::grouped(report.unreachable_viewpoints));
  }
  if (report.places_outside > 0) {
    std::cout << fmt::format("{} places along the trajectory are in no region and were left out\n",
                             cli::grouped(report.places_outside));
  }
  if (report.regions_without_viewpoints > 0) {
    std::cout << fmt::format("{} regions hold no {}, so no viewpoint: their maps are empty\n",
                             cli::grouped(report.regions_without_viewpoints),
                             report.ground_points == 0           ? "part of the trajectory"
                             : report.unreachable_viewpoints > 0 ? "reachable ground"
                                                                 : "ground");
  }
}

nlohmann::ordered_json to_json(const BuildReport& report, const MapIndex& index,
                               const WideAreaMap& map) {
  nlohmann::ordered_json regions = nlohmann::ordered_json::array();
  for (std::uint32_t r = 0; r < report.partition.size(); ++r) {
    regions.push_back({{"label", report.partition[RegionId{r}].label},
                       {"points", report.regions[r].points},
                       {"points_seen", report.seen[r]},
                       {"elements", index.regions[r].elements},
                       {"viewpoints", index.regions[r].viewpoints},
                       {"bytes", index.regions[r].bytes}});
  }
  return {
      {"map_points", report.map_points},
      {"dropped_points", map.dropped},
      {"unlisted_tiles", map.unlisted_tiles},
      {"ground_points", report.ground_points},
      {"viewpoints", report.viewpoints},
      {"skipped_viewpoints", report.skipped_viewpoints},
      {"unreachable_viewpoints", report.unreachable_viewpoints},
      {"places_outside", report.places_outside},
      {"atlas_sites", report.atlas_sites},
      {"regions_without_viewpoints", report.regions_without_viewpoints},
      {"seconds",
       {{"partition", report.seconds_partition},
        {"ground", report.seconds_ground},
        {"visibility", report.seconds_visibility}}},
      {"core_seconds",
       {{"visibility", report.core_seconds_visibility},
        {"atlas", report.core_seconds_atlas},
        {"a_viewpoint_and_million_points", report.core_seconds_a_viewpoint_and_million_points()}}},
      {"peak_memory_bytes", peak_memory()},
      {"regions", std::move(regions)}};
}

/// The output means the same wherever it is saved: a configuration that is read by its absolute
/// path has absolute paths.
Result<void> print_config(const Options& options, const PluginLoader& loader) {
  const std::string absolute =
      std::filesystem::absolute(options.config).lexically_normal().string();
  VANTAGE_TRY(Config config, load_config(absolute, options.common.overrides));
  VANTAGE_TRY(const std::string text, printed_config(std::move(config), loader));
  std::cout << text;
  return {};
}

Result<void> run(const Options& options) {
  const cli::ThreadLimit threads(options.common.jobs);
  VANTAGE_TRY(const Config config, load_config(options.config, options.common.overrides));
  const PluginLoader loader = options.common.loader();
  if (options.print_config) {
    VANTAGE_CHECK(effective_config(config, loader));  // reports errors with the file name as given
    return print_config(options, loader);
  }
  VANTAGE_TRY(const auto source, config.need(config.map, "map", "building region maps"));
  VANTAGE_TRY(BundleBuild build, BundleBuild::prepare(config, loader));
  VANTAGE_TRY(const auto map, read_map(source));
  BuildReport report;
  {
    // A partitioner may take longer than everything else, and cannot report its progress.
    if (!options.common.quiet) std::cerr << "cutting the map into regions\n";
    std::optional<cli::Progress> progress;  // its clock starts after the cutting
    VANTAGE_TRY(report, build.run(map.points, map.trajectory, [&](const BuildProgress& p) {
      if (!progress) {
        progress.emplace("building (viewpoints)", options.common.quiet);
      }
      progress->update(p.viewpoints_done, p.viewpoints);
    }));
  }
  VANTAGE_TRY(const MapIndex index, build.index());
  if (options.common.json) {
    std::cout << to_json(report, index, map).dump(2) << '\n';
  } else {
    print_report(report, index, map, options.common.style());
  }
  return {};
}

}  // namespace
}  // namespace vantage

int main(int argc, char** argv) {
  CLI::App app("Builds the observable map of every region of a wide-area map.", "vantage build");
  vantage::Options options;
  app.add_option("CONFIG", options.config, "configuration (TOML)")->required();
  app.add_flag("--print-config", options.print_config,
               "print the configuration with all defaults and --set filled in, its paths absolute, "
               "and build nothing");
  app.add_option(
         "--min-views", options.min_views,
         "keep points that at least K viewpoints of their region see: --set visibility.min_views=K")
      ->type_name("K");
  options.common.add_to(app);
  return vantage::cli::run_program(app, argc, argv, [&] {
    if (options.min_views) {
      options.common.overrides.push_back("visibility.min_views=" +
                                         std::to_string(*options.min_views));
    }
    return vantage::run(options);
  });
}
