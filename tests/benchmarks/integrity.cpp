// Whether the localizer knows when it is right: simulated worlds, what changed in them since the
// map was made, wrong starts and kidnaps, against what the localizer says of each scan.
#include <fmt/format.h>
#include <tbb/parallel_for.h>

#include <algorithm>
#include <chrono>
#include <filesystem>
#include <iostream>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "arguments.hpp"
#include "integrity_runs.hpp"
#include "integrity_scenarios.hpp"
#include "integrity_worlds.hpp"
#include "support/plugins.hpp"
#include "terminal/command_line.hpp"
#include "vantage/kit/atomic_file.hpp"
#include "world_bundles.hpp"

namespace vantage::benchmarks {
namespace {

struct Options {
  std::vector<std::uint64_t> seeds;
  std::vector<std::string> worlds, matchers{"ndt", "icp", "gicp"}, maps, scenarios;
  std::string localizer;  // lines of [localizer], with ';' between them
  std::size_t scans = 0;  // of a run; 0: all
  int kidnaps = 2;        // of a drive with kidnaps
  int stretch = 1;
  std::filesystem::path json;
  bool quick = false;
  std::size_t jobs = 1;
};

const std::vector<NamedMap>& all_maps() {
  static const std::string keep_near = "plugin = \"keep_all\"\nmax_range = 60.0";
  // The elevations are those of the simulated sensor.
  static const std::string contribution =
      "plugin = \"contribution\"\nlowest = -15.0\nhighest = 15.0\nmax_bytes = ";
  static const std::vector<NamedMap> maps{
      {.name = "whole", .partitioner = kWholeMap, .visibility = "plugin = \"keep_all\""},
      {.name = "points", .partitioner = kRegionsOf20m, .visibility = keep_near},
      {.name = "prepared",
       .partitioner = kRegionsOf20m,
       .visibility = keep_near,
       .content = "prepared"},
      {.name = "surface",
       .partitioner = kRegionsOf20m,
       .visibility = "plugin = \"surface\"\nmax_range = 60.0"},
      {.name = "hpr",
       .partitioner = kRegionsOf20m,
       .visibility = "plugin = \"hpr\"\nmax_range = 60.0\nparams = { alpha = 100.0 }"},
      {.name = "chosen20",
       .partitioner = kRegionsOf20m,
       .visibility = keep_near,
       .content = "prepared",
       .selector = contribution + "20_000"},
      {.name = "chosen80",
       .partitioner = kRegionsOf20m,
       .visibility = keep_near,
       .content = "prepared",
       .selector = contribution + "80_000"}};
  return maps;
}

/// Lines of [localizer].
std::string localizer_of(const Options& options) {
  std::string localizer = options.localizer;
  std::ranges::replace(localizer, ';', '\n');
  return "scan_min_range = 1.0\nprefetch = false\n" + localizer;
}

class Bench {
 public:
  explicit Bench(const Options& options)
      : options_(options), localizer_(localizer_of(options)), bundles_(localizer_) {}

  [[nodiscard]] Result<void> add(const NamedWorld& world, std::uint64_t seed) {
    const auto begin = std::chrono::steady_clock::now();
    const std::size_t before = scans_;
    std::vector<std::pair<DriveNeeds, std::vector<Scenario>>> drives;
    for (const Scenario scenario : world.scenarios) {
      if (!is_wanted(scenario)) continue;
      const DriveNeeds needs = needs_of(scenario, options_.kidnaps, options_.stretch);
      const auto same = std::ranges::find(drives, needs, &decltype(drives)::value_type::first);
      auto& drive =
          same == drives.end() ? drives.emplace_back(needs, std::vector<Scenario>{}) : *same;
      drive.second.push_back(scenario);
    }
    for (const auto& [needs, scenarios] : drives) {
      VANTAGE_CHECK(add(world, seed, scenarios, needs));
    }
    const std::chrono::duration<double> seconds = std::chrono::steady_clock::now() - begin;
    std::cerr << fmt::format("{}, seed {}: {} scans in {:.1f} s\n", world.name, seed,
                             scans_ - before, seconds.count());
    return {};
  }

  [[nodiscard]] const std::vector<JudgedRun>& runs() const { return runs_; }

 private:
  [[nodiscard]] bool is_wanted(Scenario scenario) const {
    if (options_.scenarios.empty()) {
      return std::ranges::find(kRepeatable, scenario) != kRepeatable.end();
    }
    return std::ranges::find(options_.scenarios, to_string(scenario)) != options_.scenarios.end();
  }

  [[nodiscard]] Result<void> add(const NamedWorld& world, std::uint64_t seed,
                                 const std::vector<Scenario>& scenarios, const DriveNeeds& needs) {
    VANTAGE_TRY(const auto params, params_of(world, seed, needs));
    VANTAGE_TRY(const JudgedDrive drive, judged_drive(world, params, options_.scans));
    const std::vector<std::string> whole{"whole"};
    for (const std::string& name : world.only_whole ? whole : options_.maps) {
      const NamedMap& map = *std::ranges::find(all_maps(), name, &NamedMap::name);
      for (const std::string& matcher : options_.matchers) {
        // Only ndt prepares maps, and selectors choose from prepared ones.
        if (map.content == "prepared" && matcher != "ndt") continue;
        VANTAGE_TRY(const Bundle bundle, bundles_.open(params, map, world.map));
        VANTAGE_TRY(const Config config, config_of(map, matcher, localizer_, bundle.name()));
        std::vector<Task> tasks;
        for (const Scenario scenario : scenarios) {
          const auto more = tasks_of(world, scenario, drive.drive, params);
          tasks.insert(tasks.end(), more.begin(), more.end());
        }
        VANTAGE_CHECK(localize_all(tasks, drive, bundle, config,
                                   {.world = world.name,
                                    .seed = seed,
                                    .matcher = matcher,
                                    .map = name,
                                    .ambiguous = world.ambiguous}));
      }
    }
    return {};
  }

  /// @param run  all but what belongs to a task
  [[nodiscard]] Result<void> localize_all(const std::vector<Task>& tasks, const JudgedDrive& drive,
                                          const Bundle& bundle, const Config& config,
                                          const JudgedRun& run) {
    std::vector<std::optional<Result<std::vector<JudgedScan>>>> done(tasks.size());
    tbb::parallel_for(std::size_t{0}, tasks.size(), [&](std::size_t k) {
      Config here = config;
      here.localizer = params_in(tasks[k].scenario, *config.localizer);
      auto localizer = Localizer::open(bundle, here, test::built_plugins());
      if (!localizer) {
        done[k] = fail(std::move(localizer).error());
      } else {
        done[k] = localize(*std::move(localizer), tasks[k], drive);
      }
    });
    for (std::size_t k = 0; k < tasks.size(); ++k) {
      runs_.push_back(run);
      runs_.back().scenario = to_string(tasks[k].scenario);
      runs_.back().part = tasks[k].part;
      VANTAGE_TRY(runs_.back().scans, *std::move(done[k]));
      scans_ += runs_.back().scans.size();
    }
    return {};
  }

  const Options& options_;
  std::string localizer_;  // lines of [localizer]
  WorldBundles bundles_;
  std::vector<JudgedRun> runs_;
  std::size_t scans_ = 0;
};

/// What the command line leaves open, for a look of some minutes.
Options quick(Options options) {
  if (options.seeds.empty()) options.seeds = {101};
  if (options.maps.empty()) options.maps = {"points"};
  if (options.scans == 0) options.scans = 60;
  if (options.worlds.empty()) {  // all but the sites whose maps take minutes
    for (const NamedWorld& world : all_worlds()) {
      if (world.name != "large" && world.name != "site_800") options.worlds.push_back(world.name);
    }
  }
  return options;
}

Result<void> run(Options options) {
  if (options.quick) options = quick(std::move(options));
  if (options.seeds.empty()) options.seeds = {101, 102};
  if (options.maps.empty()) options.maps = {"whole", "points", "prepared"};
  const cli::ThreadLimit threads(options.jobs);
  const auto begin = std::chrono::steady_clock::now();
  std::vector<JudgedRun> runs;
  std::size_t scans = 0;
  for (const std::uint64_t seed : options.seeds) {
    std::cout << fmt::format("Seed {}: {}.\n", seed, use_of_seed(seed));
    Bench bench(options);
    for (const NamedWorld& world : all_worlds()) {
      if (options.worlds.empty() ||
          std::ranges::find(options.worlds, world.name) != options.worlds.end()) {
        VANTAGE_CHECK(bench.add(world, seed));
      }
    }
    for (const JudgedRun& run : bench.runs()) scans += run.scans.size();
    runs.insert(runs.end(), bench.runs().begin(), bench.runs().end());
  }
  const std::chrono::duration<double> seconds = std::chrono::steady_clock::now() - begin;
  std::cerr << fmt::format("{} scans in {:.0f} s: {:.0f} a minute\n", scans, seconds.count(),
                           60.0 * static_cast<double>(scans) / seconds.count());
  print(runs);
  if (options.json.empty()) return {};
  return io::write_text_atomically(options.json, to_json(runs));
}

void declare(Arguments& arguments, Options& options) {
  arguments.program(
      "./dev bench integrity",
      "Whether the localizer knows when it is right: simulated worlds, changes since the map was "
      "made, wrong starts and kidnaps; markdown tables.");
  const auto names = [](const auto& all) {
    std::vector<std::string> result;
    for (const auto& one : all) result.push_back(one.name);
    return result;
  };
  std::vector<std::string> scenarios;
  for (const Scenario scenario : kRepeatable) scenarios.emplace_back(to_string(scenario));
  scenarios.emplace_back(to_string(Scenario::live));
  arguments
      .add("--seeds", options.seeds,
           "of the worlds, none of configs/simulate; 101 and 102 if left out", "N,N,...")
      ->delimiter(',');
  arguments
      .add("--worlds", options.worlds, "all if left out", "NAME,NAME,...",
           CLI::IsMember(names(all_worlds())))
      ->delimiter(',');
  arguments
      .shown("--matchers", options.matchers, "which", "NAME,NAME,...",
             CLI::IsMember({"ndt", "icp", "gicp"}))
      ->delimiter(',');
  arguments
      .add("--maps", options.maps,
           "the whole map, region maps with points, region maps that ndt prepared, what surface or "
           "hpr take for visible, and the 20 or 80 kB that contribute; the first three if left out",
           "NAME,NAME,...", CLI::IsMember(names(all_maps())))
      ->delimiter(',');
  arguments
      .add("--scenarios", options.scenarios,
           "all but live if left out, whose results depend on the machine", "NAME,NAME,...",
           CLI::IsMember(scenarios))
      ->delimiter(',');
  arguments.add("--localizer", options.localizer, "keys of [localizer]: 'min_nvtl = 0.6; ...'",
                "PARAMS");
  arguments.add("--scans", options.scans, "the first of each drive only", "N", CLI::PositiveNumber);
  arguments.shown("--kidnaps", options.kidnaps, "in each drive with kidnaps", "N",
                  CLI::Range(1, 1000));
  arguments.shown(
      "--stretch", options.stretch,
      "with odometry, scans that are no raw sweeps are so many times as far apart, and drives as "
      "long",
      "N", CLI::Range(1, 100));
  arguments.add("--json", options.json, "where to write what was said of each scan", "FILE");
  arguments.flag(
      "--quick", options.quick,
      "unless given: one seed, region maps with points, 60 scans a drive, no large sites");
  arguments.shown("-j,--jobs", options.jobs, "threads; results do not depend on it; 0: all", "N");
}

const auto program = table(declare, run);

}  // namespace
}  // namespace vantage::benchmarks

int main(int argc, char** argv) { return vantage::benchmarks::program(argc, argv); }
