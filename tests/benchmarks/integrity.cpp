// Whether the localizer knows when it is right: simulated worlds, what changed in them since the
// map was made, wrong starts and kidnaps, against what the localizer says of each scan.
#include <fmt/format.h>
#include <tbb/parallel_for.h>

#include <algorithm>
#include <chrono>
#include <cmath>
#include <filesystem>
#include <iostream>
#include <numbers>
#include <optional>
#include <string>
#include <thread>
#include <utility>
#include <vector>

#include "arguments.hpp"
#include "drive.hpp"
#include "integrity_runs.hpp"
#include "integrity_worlds.hpp"
#include "simulate/random.hpp"
#include "support/plugins.hpp"
#include "terminal/command_line.hpp"
#include "vantage/kit/atomic_file.hpp"
#include "world_bundles.hpp"

namespace vantage::benchmarks {
namespace {

constexpr std::size_t kScansAfterWrongStart = 30;

struct Options {
  std::vector<std::uint64_t> seeds;
  std::vector<std::string> worlds, matchers{"ndt", "icp", "gicp"}, maps, scenarios;
  std::string localizer;  // lines of [localizer], with ';' between them
  std::size_t scans = 0;  // of a run; 0: all
  int kidnaps = 2;        // of a drive with kidnaps
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

/// A run that is to be done.
struct Task {
  Scenario scenario;
  std::size_t part = 0;
  Pose start;
  std::size_t begin = 0, end = 0;  // scans
};

/// 5 to 40 m and any heading off, within the campus.
Pose wrong_start(const Pose& T_map_sensor, const simulation::WorldParams& params,
                 std::size_t part) {
  simulation::Random random(hash(params.seed, 0x577a47U, part));
  constexpr double kPi = std::numbers::pi, kBorder = 5.0;
  while (true) {
    const double metres = random.uniform(5.0, 40.0), direction = kPi * random.symmetric();
    const Point place =
        T_map_sensor.translation + metres * Point(std::cos(direction), std::sin(direction), 0.0);
    const double turn = kPi * random.symmetric();
    if (std::abs(place.x() - params.campus.origin_x) > params.campus.size_x / 2.0 - kBorder ||
        std::abs(place.y() - params.campus.origin_y) > params.campus.size_y / 2.0 - kBorder) {
      continue;
    }
    return {.rotation = rotation_from_vector({0.0, 0.0, turn}) * T_map_sensor.rotation,
            .translation = place};
  }
}

std::vector<Task> tasks_of(const NamedWorld& world, Scenario scenario, const SimulatedDrive& drive,
                           const simulation::WorldParams& params) {
  const std::size_t scans = drive.scans.size();
  if (scenario != Scenario::wrong_start) {
    return {
        {.scenario = scenario, .start = drive.reference.front().pose, .begin = 0, .end = scans}};
  }
  std::vector<Task> tasks;
  const auto starts = static_cast<std::size_t>(world.wrong_starts);
  const std::size_t length = std::min(kScansAfterWrongStart, scans);
  for (std::size_t k = 0; k < starts; ++k) {
    const std::size_t begin = k * (scans - length) / std::max<std::size_t>(1, starts - 1);
    tasks.push_back({.scenario = scenario,
                     .part = k,
                     .start = wrong_start(drive.reference[begin].pose, params, k),
                     .begin = begin,
                     .end = begin + length});
  }
  return tasks;
}

/// GNSS among buildings: 1.5 m off all the time, and 30 m off in the middle third of the drive.
PosePrior biased_prior(const SimulatedDrive& drive, std::size_t i) {
  const bool jumps = 3 * i >= drive.scans.size() && 3 * i < 2 * drive.scans.size();
  PosePrior prior{.T_map_sensor = drive.reference[i].pose};
  prior.T_map_sensor.translation += Point(jumps ? 30.0 : 1.5, 0.0, 1.0);
  prior.sigma_translation = {3.0, 3.0, 3.0};
  return prior;
}

JudgedScan judge(const ScanReport& report, const Pose& truth) {
  JudgedScan scan{.stamp = report.stamp,
                  .tracking = report.tracking,
                  .risk = report.risk,
                  .has_pose = report.has_pose,
                  .seconds_align = report.seconds_align,
                  .seconds_search = report.seconds_search,
                  .seconds_verdict = report.seconds_verdict,
                  .reason = report.reason};
  if (report.has_pose) {
    const PoseError error = error_of(report.T_map_scan, truth);
    scan.metres = error.centimetres / 100.0;
    scan.degrees = error.degrees;
  }
  if (report.alignment) {
    scan.nvtl = report.alignment->score.nvtl;
    scan.coverage = report.alignment->score.coverage;
  }
  return scan;
}

/// @param live  scans come at the pace of their stamps
Result<std::vector<JudgedScan>> localize(Localizer localizer, bool live, const Task& task,
                                         const SimulatedDrive& drive) {
  VANTAGE_CHECK(localizer.start(task.start));
  std::vector<JudgedScan> scans;
  const auto begin = std::chrono::steady_clock::now();
  for (std::size_t i = task.begin; i < task.end; ++i) {
    const std::chrono::duration<double> since(drive.reference[i].stamp -
                                              drive.reference[task.begin].stamp);
    if (live) std::this_thread::sleep_until(begin + since);
    if (task.scenario != Scenario::constant_velocity) {
      const double stamp = drive.reference[i].stamp;
      VANTAGE_CHECK(localizer.add(OdometrySample{stamp, drive.odometry[i].pose}));
    }
    Scan scan = drive.scan(i);
    if (task.scenario == Scenario::prior) scan.prior = biased_prior(drive, i);
    VANTAGE_TRY(const ScanReport report, localizer.localize(scan));
    scans.push_back(judge(report, drive.reference[i].pose));
    scans.back().misled =
        drive.kidnapped[i] || (task.scenario == Scenario::wrong_start && i == task.begin);
  }
  return scans;
}

class Bench {
 public:
  explicit Bench(const Options& options)
      : options_(options), localizer_(localizer_of(options)), bundles_(localizer_) {}

  [[nodiscard]] Result<void> add(const NamedWorld& world, std::uint64_t seed) {
    const auto begin = std::chrono::steady_clock::now();
    const std::size_t before = scans_;
    for (const bool kidnapped : {false, true}) {
      std::vector<Scenario> scenarios;
      for (const Scenario scenario : world.scenarios) {
        if ((scenario == Scenario::kidnap) == kidnapped && is_wanted(scenario)) {
          scenarios.push_back(scenario);
        }
      }
      if (!scenarios.empty()) VANTAGE_CHECK(add(world, seed, scenarios, kidnapped));
    }
    const std::chrono::duration<double> seconds = std::chrono::steady_clock::now() - begin;
    std::cerr << fmt::format("{}, seed {}: {} scans in {:.1f} s\n", world.name, seed,
                             scans_ - before, seconds.count());
    return {};
  }

  [[nodiscard]] const std::vector<JudgedRun>& runs() const { return runs_; }

 private:
  [[nodiscard]] bool is_wanted(Scenario scenario) const {
    return options_.scenarios.empty() ||
           std::ranges::find(options_.scenarios, to_string(scenario)) != options_.scenarios.end();
  }

  [[nodiscard]] Result<void> add(const NamedWorld& world, std::uint64_t seed,
                                 const std::vector<Scenario>& scenarios, bool kidnapped) {
    VANTAGE_TRY(const auto params, params_of(world, seed, kidnapped ? options_.kidnaps : 0));
    VANTAGE_TRY(const SimulatedDrive drive, simulated_drive(params, options_.scans, params.seed));
    for (const std::string& name : options_.maps) {
      const NamedMap& map = *std::ranges::find(all_maps(), name, &NamedMap::name);
      for (const std::string& matcher : options_.matchers) {
        // Only ndt prepares maps, and selectors choose from prepared ones.
        if (map.content == "prepared" && matcher != "ndt") continue;
        VANTAGE_TRY(const Bundle bundle, bundles_.open(params, map, world.second_copy));
        VANTAGE_TRY(const Config config, config_of(map, matcher, localizer_, bundle.name()));
        std::vector<Task> tasks;
        for (const Scenario scenario : scenarios) {
          const auto more = tasks_of(world, scenario, drive, params);
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
  [[nodiscard]] Result<void> localize_all(const std::vector<Task>& tasks,
                                          const SimulatedDrive& drive, const Bundle& bundle,
                                          const Config& config, const JudgedRun& run) {
    std::vector<std::optional<Result<std::vector<JudgedScan>>>> done(tasks.size());
    tbb::parallel_for(std::size_t{0}, tasks.size(), [&](std::size_t k) {
      auto localizer = Localizer::open(bundle, config, test::built_plugins());
      if (!localizer) {
        done[k] = fail(std::move(localizer).error());
      } else {
        const bool live = config.localizer && config.localizer->live;
        done[k] = localize(*std::move(localizer), live, tasks[k], drive);
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

/// What the command line leaves open, for a look of a minute.
Options quick(Options options) {
  if (options.seeds.empty()) options.seeds = {101};
  if (options.maps.empty()) options.maps = {"points"};
  if (options.scans == 0) options.scans = 60;
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
  for (const Scenario scenario : kScenarios) scenarios.emplace_back(to_string(scenario));
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
           "the whole map, region maps with points, region maps that ndt prepared, and the 20 or "
           "80 kB of those that contribute; the first three if left out",
           "NAME,NAME,...", CLI::IsMember(names(all_maps())))
      ->delimiter(',');
  arguments
      .add("--scenarios", options.scenarios, "all if left out", "NAME,NAME,...",
           CLI::IsMember(scenarios))
      ->delimiter(',');
  arguments.add("--localizer", options.localizer, "keys of [localizer]: 'min_nvtl = 0.6; ...'",
                "PARAMS");
  arguments.add("--scans", options.scans, "the first of each drive only", "N", CLI::PositiveNumber);
  arguments.shown("--kidnaps", options.kidnaps, "in each drive with kidnaps", "N",
                  CLI::Range(1, 1000));
  arguments.add("--json", options.json, "where to write what was said of each scan", "FILE");
  arguments.flag("--quick", options.quick,
                 "unless given: one seed, region maps with points, 60 scans a drive");
  arguments.shown("-j,--jobs", options.jobs, "threads; results do not depend on it; 0: all", "N");
}

const auto program = table(declare, run);

}  // namespace
}  // namespace vantage::benchmarks

int main(int argc, char** argv) { return vantage::benchmarks::program(argc, argv); }
