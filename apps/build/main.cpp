// vantage-build: makes a bundle of region maps from a wide-area map and a configuration.
#include <fmt/format.h>

#include <iostream>
#include <nlohmann/json.hpp>
#include <optional>
#include <span>
#include <string>

#include "building/input.hpp"
#include "building/summary.hpp"
#include "checks/notes.hpp"
#include "print_config.hpp"
#include "terminal/command_line.hpp"
#include "terminal/counts.hpp"
#include "terminal/progress.hpp"
#include "vantage/kit/json_text.hpp"

namespace vantage {
namespace {

struct Options : building::Options {
  bool print_config = false;
  std::optional<std::uint32_t> min_views;
  std::string shard;
};

/// The output means the same wherever it is saved: a configuration that is read by its absolute
/// path has absolute paths.
Result<void> print_config(const Options& options, const PluginLoader& loader) {
  const std::string absolute =
      std::filesystem::absolute(options.config).lexically_normal().string();
  VANTAGE_TRY(Config config, load_config(absolute, options.overrides()));
  VANTAGE_TRY(const std::string text, printed_config(std::move(config), loader));
  std::cout << text;
  return {};
}

/// Shows the progress of a build. Its clock starts with the first viewpoint.
class Told {
 public:
  explicit Told(bool quiet) : quiet_(quiet) {}
  void operator()(const BuildProgress& now) {
    if (!progress_) progress_.emplace("building (viewpoints)", quiet_);
    progress_->update(now.viewpoints_done, now.viewpoints);
  }

 private:
  bool quiet_;
  std::optional<cli::Progress> progress_;
};

Result<void> build_shard(const Options& options) {
  VANTAGE_TRY(const Shard shard, building::parse_shard(options.shard));
  VANTAGE_TRY(auto prepared, building::prepare(options, building::Reading::never));
  VANTAGE_CHECK(building::read_scans(prepared, options.common.quiet));
  const io::TiledParts parts(*prepared.map.tiles);
  VANTAGE_TRY(ShardedBuild build, building::open_shards(prepared, parts));
  std::size_t built = 0;
  {
    Told told(options.common.quiet);
    VANTAGE_TRY(built, build.build(shard, [&](const BuildProgress& now) { told(now); }));
  }
  VANTAGE_TRY(const ShardStatus status, build.status(shard));
  if (options.common.json) {
    std::cout << json_text(nlohmann::ordered_json{{"shard", shard.number},
                                                  {"shards", shard.count},
                                                  {"regions", status.regions},
                                                  {"built", built},
                                                  {"viewpoints", status.viewpoints}});
  } else {
    std::cout << fmt::format("shard {} of {}: {}, {} of them built now; parts in {}\n",
                             cli::grouped(shard.number), cli::grouped(shard.count),
                             cli::counted(status.regions, "region"), cli::grouped(built),
                             prepared.parts.string());
  }
  return {};
}

/// Says what is suspicious about the map. The bundle keeps what concerns the map alone, so that
/// localization can say it, too.
Result<void> note_suspicions(building::Prepared& prepared, const Options& options) {
  if (prepared.map.tiles) return {};  // `vantage check` looks at a sample
  VANTAGE_TRY(const Config config, with_plugin_defaults(prepared.config, options.common.loader()));
  const checks::MapFacts map = checks::measure_map(prepared.map.points);
  checks::print(std::cerr, notes_on(map, config));
  if (const auto notes = notes_on(map); !notes.empty()) {
    prepared.build.attach(checks::kNotesAttachment, checks::encode(notes));
  }
  return {};
}

/// Says what follows from a configuration without a matcher.
void note_no_matcher(const Config& config) {
  if (config.matcher) return;
  const checks::Note note{
      "the configuration has no [matcher]: the bundle gets points, but no prepared maps, and "
      "`vantage assess` and `vantage localize` need one",
      "add the lines `[matcher]` and `plugin = \"ndt\"`"};
  checks::print(std::cerr, std::span(&note, 1));
}

/// Plans, builds all regions that are not finished, and merges.
Result<BuildReport> build_of_tiles(building::Prepared& prepared, const Options& options) {
  const io::TiledParts parts(*prepared.map.tiles);
  VANTAGE_TRY(ShardedBuild build, building::open_shards(prepared, parts));
  {
    Told told(options.common.quiet);
    VANTAGE_CHECK(build.build({1, 1}, [&](const BuildProgress& now) { told(now); }));
  }
  if (!options.common.quiet) std::cerr << "merging the regions\n";
  return build.merge();
}

Result<void> run(const Options& options) {
  const cli::ThreadLimit threads(options.common.jobs);
  if (options.print_config) {
    VANTAGE_TRY(const Config config, load_config(options.config, options.overrides()));
    const PluginLoader loader = options.common.loader();
    VANTAGE_CHECK(effective_config(config, loader));  // reports errors with the file name as given
    return print_config(options, loader);
  }
  if (!options.shard.empty()) return build_shard(options);
  VANTAGE_TRY(auto prepared, building::prepare(options, building::Reading::if_they_fit));
  VANTAGE_CHECK(note_suspicions(prepared, options));
  if (!options.common.quiet) note_no_matcher(prepared.config);
  VANTAGE_CHECK(building::read_scans(prepared, options.common.quiet));
  // A partitioner may take longer than everything else, and cannot report its progress.
  if (!options.common.quiet) std::cerr << "cutting the map into regions\n";
  BuildReport report;
  if (prepared.map.tiles) {
    VANTAGE_TRY(report, build_of_tiles(prepared, options));
  } else {
    Told told(options.common.quiet);
    VANTAGE_TRY(report, prepared.build.run(prepared.map.points, prepared.map.trajectory,
                                           [&](const BuildProgress& now) { told(now); }));
  }
  return building::print_summary(report, prepared, options.common);
}

}  // namespace
}  // namespace vantage

int main(int argc, char** argv) {
  CLI::App app("Builds the observable map of every region of a wide-area map.", "vantage build");
  vantage::Options options;
  options.add_to(app);
  app.add_flag("--print-config", options.print_config,
               "build nothing; print the configuration with all defaults and --set filled in and "
               "with absolute paths");
  app.add_option(
         "--min-views", options.min_views,
         "keep points that at least K viewpoints of their region see: --set visibility.min_views=K")
      ->type_name("K");
  app.add_option("--shard", options.shard,
                 "build only part I of N of a tiled map, and no bundle; `vantage merge` makes the "
                 "bundle of all parts")
      ->type_name("I/N");
  return vantage::cli::run_program(app, argc, argv, [&] {
    if (options.min_views) {
      options.common.overrides.push_back("visibility.min_views=" +
                                         std::to_string(*options.min_views));
    }
    return vantage::run(options);
  });
}
