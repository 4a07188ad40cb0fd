// vantage-assess: measures how well a sensor can be localized in a finished bundle.
#include <fmt/format.h>

#include <algorithm>
#include <filesystem>
#include <iostream>
#include <nlohmann/json.hpp>
#include <optional>
#include <string>
#include <thread>

#include "building/input.hpp"
#include "localizability/localizability.hpp"
#include "terminal/command_line.hpp"
#include "terminal/counts.hpp"
#include "terminal/progress.hpp"
#include "terminal/size.hpp"
#include "vantage/build/assessment.hpp"
#include "vantage/engine/localizer_params.hpp"
#include "vantage/kit/json_text.hpp"

namespace vantage {
namespace {

namespace fs = std::filesystem;

struct Options {
  std::string what;
  std::string memory = "4GiB";
  cli::CommonOptions common;
};

/// A bundle, and the configuration that says how it is assessed.
struct Subject {
  Bundle bundle;
  Config config;
  bool by_path;  // the configuration is that in the bundle
};

/// Leaves out the plugin files that a bundle's configuration names. They are those of the machine
/// that built, and a bundle of somebody else must not choose what code runs here.
void forget_libraries(Table& config) {
  for (Entry& section : config.entries) {
    if (auto* const table = std::get_if<Table>(&section.value.data)) {
      std::erase_if(table->entries, [](const Entry& entry) { return entry.key == "library"; });
    }
  }
}

Result<Subject> subject_of(const Options& options) {
  const PluginLoader plugins = options.common.loader();
  std::error_code ignored;
  if (!fs::is_directory(options.what, ignored)) {
    VANTAGE_TRY(Config config, load_config(options.what, options.common.overrides));
    VANTAGE_TRY(Bundle bundle, Bundle::open(config, plugins, "assessing"));
    return Subject{std::move(bundle), std::move(config), false};
  }
  VANTAGE_TRY(Bundle bundle, Bundle::open(fs::path(options.what), plugins));
  VANTAGE_TRY(Table kept, parse_toml(bundle.directory()->summary().config, ""));
  forget_libraries(kept);
  VANTAGE_TRY(const Table table, with_overrides(std::move(kept), options.common.overrides));
  VANTAGE_TRY(Config config, parse_config(table));
  config.file = bundle.name();
  if (!config.matcher) {
    return fail(ErrorCode::invalid_config,
                "the bundle keeps points, and says nothing of a matcher: name it with --set "
                "matcher.plugin=ndt, or give the configuration instead of the bundle",
                SourceLocation{bundle.name(), 0, 0});
  }
  return Subject{std::move(bundle), std::move(config), true};
}

Result<building::WideAreaMap> map_of(const Subject& subject, std::uint64_t memory) {
  VANTAGE_TRY(const auto source, subject.config.need(subject.config.map, "map", "an assessment"));
  auto map = building::read_map(subject.config, source, memory, building::Reading::if_they_fit);
  if (map || !subject.by_path || map.error().code != ErrorCode::not_found) return map;
  Error error = std::move(map).error();
  error.where.reset();  // the configuration in a bundle has no lines
  error.message +=
      "; the bundle was built of it: name it with --set 'map.files=[\"FILE\"]', or "
      "give the configuration instead of the bundle";
  return fail(std::move(error).during("assessing " + subject.bundle.name()));
}

/// With a map in parts, each thread has what is around a site in memory: as many threads as fit,
/// and at least one.
/// @param reach   of the assessment [m]
/// @param memory  [bytes]
Result<std::size_t> threads_for(const Bundle& bundle, const io::TiledParts& map, double reach,
                                std::uint64_t memory, std::size_t jobs) {
  constexpr std::uint64_t kBytesAPoint = 48;  // with what finds neighbours
  const std::size_t wanted = jobs > 0 ? jobs : std::max(1U, std::thread::hardware_concurrency());
  const Eigen::Vector2d margin = Eigen::Vector2d::Constant(reach);
  std::uint64_t most = 1;
  const RegionDirectory& directory = *bundle.directory();
  for (std::uint32_t r = 0; r < directory.summary().regions; ++r) {
    VANTAGE_TRY(const DirectoryEntry entry, directory.entry(RegionId{r}));
    if (entry.summary.viewpoints == 0) continue;
    const Bounds2 region = bounds_of(entry.region.footprint);
    most = std::max(most, map.points_in({region.min - margin, region.max + margin}));
  }
  return std::clamp<std::size_t>(memory / (kBytesAPoint * most), 1, wanted);
}

/// @param alert_limit  [m]
void print(const AssessmentReport& report, double alert_limit, const Options& options) {
  const Localizability all = localizability_of(report.atlas, alert_limit);
  const Statistics& error = all.expected_error;
  if (options.common.json) {
    nlohmann::ordered_json json{{"matcher", report.atlas.matcher.plugin},
                                {"sites", all.sites},
                                {"unmatched_sites", all.unmatched},
                                {"expected_error", nullptr},
                                {"alert_limit", alert_limit},
                                {"sites_beyond_alert_limit", all.beyond_limit},
                                {"sites_with_alike_places", all.alike},
                                {"seconds", report.seconds},
                                {"core_seconds", report.core_seconds}};
    if (error.count > 0) {
      json["expected_error"] = {{"median", error.median}, {"p95", error.p95}, {"max", error.max}};
    }
    std::cout << json_text(json);
    return;
  }
  std::cout << fmt::format("{} for {}", cli::counted(all.sites, "site"),
                           report.atlas.matcher.plugin);
  if (error.count > 0) {
    std::cout << fmt::format(": expected error {:.3f} m median, {:.3f} m or less at 95 %",
                             error.median, error.p95);
  }
  std::cout << fmt::format(
      "; above {:g} m at {}, alike places at {}, no match at {}\n{:.1f} s, {:.1f} core-seconds; "
      "the bundle keeps it, and `vantage info` shows more\n",
      alert_limit, cli::grouped(all.beyond_limit), cli::grouped(all.alike),
      cli::grouped(all.unmatched), report.seconds, report.core_seconds);
}

Result<void> run(const Options& options) {
  const cli::ThreadLimit threads(options.common.jobs);
  const auto memory = cli::parse_memory(options.memory);
  if (!memory) return cli::usage_error(cli::not_memory(options.memory));
  VANTAGE_TRY(const Subject subject, subject_of(options));
  VANTAGE_TRY(Assessment assessment,
              Assessment::prepare(subject.bundle, subject.config, options.common.loader()));
  VANTAGE_TRY(const building::WideAreaMap map, map_of(subject, *memory));
  AssessmentReport report;
  {
    std::optional<cli::Progress> progress;
    const auto told = [&](std::size_t done, std::size_t total) {
      if (!progress) progress.emplace("assessing (steps)", options.common.quiet);
      progress->update(done, total);
    };
    if (map.tiles) {
      const io::TiledParts parts(*map.tiles);
      VANTAGE_TRY(const std::size_t fitting, threads_for(subject.bundle, parts, assessment.reach(),
                                                         *memory, options.common.jobs));
      const cli::ThreadLimit fewer(fitting);
      VANTAGE_TRY(report, assessment.run(parts, told));
    } else {
      VANTAGE_TRY(report, assessment.run(map.points, told));
    }
  }
  print(report, subject.config.localizer.value_or(LocalizerParams{}).alert_limit, options);
  return {};
}

}  // namespace
}  // namespace vantage

int main(int argc, char** argv) {
  CLI::App app(
      "Measures with virtual scans how well a sensor can be localized in a bundle, and keeps the "
      "answer in it.",
      "vantage assess");
  vantage::Options options;
  app.add_option("BUNDLE", options.what, "configuration (TOML) of a bundle, or its folder")
      ->required()
      ->check(CLI::ExistingPath);
  app.add_option(
         "--memory", options.memory,
         "memory for the map, in MiB or GiB; of a tiled map that needs more, only what is around "
         "some sites is read at a time, one for each thread that fits")
      ->capture_default_str();
  options.common.add_to(app);
  return vantage::cli::run_program(app, argc, argv, [&] { return vantage::run(options); });
}
