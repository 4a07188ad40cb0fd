// How well a sensor that moves is localized: raw sweeps of simulated drives at several speeds, with
// nothing else, with an IMU, and with odometry.
#include <fmt/format.h>
#include <tbb/parallel_for.h>

#include <algorithm>
#include <array>
#include <chrono>
#include <cstdint>
#include <filesystem>
#include <iostream>
#include <memory>
#include <numbers>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "arguments.hpp"
#include "drive.hpp"
#include "integrity_runs.hpp"
#include "integrity_worlds.hpp"
#include "simulate/simulation.hpp"
#include "support/plugins.hpp"
#include "support/real_data.hpp"
#include "terminal/command_line.hpp"
#include "vantage/evaluation/run.hpp"
#include "vantage/evaluation/statistics.hpp"
#include "vantage/io/imu_io.hpp"
#include "vantage/io/trajectory_io.hpp"
#include "world_bundles.hpp"

namespace vantage::benchmarks {
namespace {

namespace fs = std::filesystem;

struct Options {
  std::vector<std::uint64_t> seeds{311, 312};
  std::vector<double> speeds{1.5, 8.0, 15.0};  // [m/s]
  std::vector<std::string> matchers{"ndt"}, maps{"whole"};
  std::optional<double> length;  // of each drive [m]
  bool no_mid360 = false;
  std::size_t jobs = 1;
};

const std::vector<NamedMap>& all_maps() {
  static const std::vector<NamedMap> maps{
      {.name = "whole", .partitioner = kWholeMap, .visibility = "plugin = \"keep_all\""},
      // As configs/demo/surface.toml; the worlds here have the points of the demo's campus.
      {.name = "surface",
       .partitioner = kRegionsOf20m,
       .visibility = "plugin = \"surface\"\nmax_range = 100.0\nparams = { point_spacing = 0.16 }",
       .viewpoint_spacing = 5.0}};
  return maps;
}

enum class Aid : std::uint8_t { nothing, imu, odometry };
constexpr std::array kAids{Aid::nothing, Aid::imu, Aid::odometry};
const char* to_string(Aid aid) noexcept {
  switch (aid) {
    case Aid::nothing: return "nothing";
    case Aid::imu: return "IMU";
    case Aid::odometry: return "odometry";
  }
  return "";
}

/// A row of a table: how scans are localized, and what came of it in the worlds of all seeds.
struct Row {
  std::string map, matcher;
  double speed = 0.0;  // [m/s]
  Aid aid = Aid::nothing;
  bool start_anywhere = false;

  std::size_t scans = 0, tracked = 0, beyond = 0;
  std::vector<double> centimetres = {}, degrees = {};  // errors of the poses
  std::vector<double> predicted = {};                  // errors of the predictions [cm]
  std::vector<double> passes = {}, align = {};         // of the scans that were aligned; [ms]

  void add(const Run& run) {
    for (const RunScan& scan : run.scans) {
      ++scans;
      if (is_tracked(scan)) ++tracked;
      if (scan.error) {
        if (scan.error->metres > kAlertMetres) ++beyond;
        centimetres.push_back(1e2 * scan.error->metres);
        degrees.push_back(scan.error->degrees);
      }
      if (scan.prediction_error) predicted.push_back(1e2 * scan.prediction_error->metres);
      if (scan.report.passes == 0) continue;
      passes.push_back(scan.report.passes);
      align.push_back(1e3 * scan.report.seconds_align);
    }
  }
};

// ---- a drive

/// A simulated recording in a folder of its own.
class Recording {
 public:
  /// Errors: those of simulate and of the readers.
  [[nodiscard]] static Result<std::unique_ptr<const Recording>> of(
      const simulation::WorldParams& params) {
    auto made = std::make_unique<Recording>();
    VANTAGE_CHECK(simulation::simulate(params, made->place()));
    VANTAGE_TRY(made->reference_, io::read_trajectory(made->place() / "reference.tum"));
    VANTAGE_TRY(made->odometry_, io::read_trajectory(made->place() / "odometry.tum"));
    VANTAGE_TRY(made->imu_, io::read_imu({.path = made->place() / "imu.csv"}));
    return made;
  }

  [[nodiscard]] RunInputs inputs(Aid aid, bool start_anywhere) const {
    RunInputs inputs;
    inputs.scans.path = place() / "scans";
    inputs.start_anywhere = start_anywhere;
    inputs.reference = reference_;
    if (aid == Aid::odometry) inputs.odometry = odometry_;
    if (aid == Aid::imu) inputs.imu = imu_;
    return inputs;
  }

 private:
  [[nodiscard]] fs::path place() const { return folder_.path() / "drive"; }

  test::TemporaryFolder folder_;
  io::Trajectory reference_, odometry_;
  io::ImuRecording imu_;
};

Result<simulation::WorldParams> world_of(const char* file, std::uint64_t seed,
                                         const Options& options,
                                         std::vector<std::string> overrides) {
  VANTAGE_CHECK(check_seed(seed));
  overrides.push_back(fmt::format("seed={}", seed));
  if (options.length) overrides.push_back(fmt::format("drive.length={:.3f}", *options.length));
  return simulation::load_world(fs::path(VANTAGE_SOURCE_DIR) / "configs/simulate" / file,
                                overrides);
}

/// The demo's campus, as a recording sees it.
Result<simulation::WorldParams> demo(std::uint64_t seed, double speed, const Options& options) {
  return world_of("demo.toml", seed, options,
                  {"lidar.motion_distortion=true", "drive.scan_every=1", "imu.rate=200.0",
                   "odometry.rate=20.0", fmt::format("drive.speed={:.3f}", speed)});
}

/// The line of [localizer] that says where the IMU is.
std::string mount_of(const simulation::ImuParams& imu) {
  constexpr double kRadians = std::numbers::pi / 180.0;
  return fmt::format("T_sensor_imu = [{:.6f}, {:.6f}, {:.6f}, {:.6f}, {:.6f}, {:.6f}]",
                     imu.position.x(), imu.position.y(), imu.position.z(), imu.roll * kRadians,
                     imu.pitch * kRadians, imu.yaw * kRadians);
}

// ---- all drives

class MotionBench {
 public:
  explicit MotionBench(const Options& options) : options_(options) {
    for (const std::string& map : options.maps) {
      for (const std::string& matcher : options.matchers) {
        for (const double speed : options.speeds) {
          for (const Aid aid : kAids) {
            vlp16_.push_back({.map = map, .matcher = matcher, .speed = speed, .aid = aid});
          }
        }
        for (const bool anywhere : {false, true}) {
          mid360_.push_back(
              {.map = map, .matcher = matcher, .aid = Aid::imu, .start_anywhere = anywhere});
        }
      }
    }
  }

  [[nodiscard]] Result<void> add(std::uint64_t seed) {
    WorldBundles bundles("");
    for (const double speed : options_.speeds) {
      VANTAGE_TRY(const auto params, demo(seed, speed, options_));
      std::vector<Row*> rows;
      for (Row& row : vlp16_) {
        if (row.speed == speed) rows.push_back(&row);
      }
      VANTAGE_CHECK(add(params, bundles, rows));
    }
    if (options_.no_mid360) return {};
    VANTAGE_TRY(const auto params, world_of("mid360.toml", seed, options_, {}));
    std::vector<Row*> rows;
    for (Row& row : mid360_) rows.push_back(&row);
    return add(params, bundles, rows);
  }

  void print() const {
    print_head("VLP-16", head({"speed [m/s]", "aid"}));
    for (const Row& row : vlp16_) {
      print_row(cells(row, {fmt::format("{:g}", row.speed), to_string(row.aid)}));
    }
    if (options_.no_mid360) return;
    print_head("MID-360 upside down, with its IMU", head({"start"}));
    for (const Row& row : mid360_) {
      print_row(cells(row, {row.start_anywhere ? "anywhere" : "known"}));
    }
  }

 private:
  /// Localizes one drive as each of the rows says.
  [[nodiscard]] Result<void> add(const simulation::WorldParams& params, WorldBundles& bundles,
                                 const std::vector<Row*>& rows) {
    const auto begin = std::chrono::steady_clock::now();
    VANTAGE_TRY(const auto drive, Recording::of(params));
    std::vector<Bundle> opened;
    for (const Row* row : rows) {
      const NamedMap& map = *std::ranges::find(all_maps(), row->map, &NamedMap::name);
      VANTAGE_TRY(Bundle bundle, bundles.open(params, map));
      opened.push_back(std::move(bundle));
    }
    std::vector<std::optional<Result<Run>>> done(rows.size());
    tbb::parallel_for(std::size_t{0}, rows.size(), [&](std::size_t k) {
      done[k] = localized(*drive, params, opened[k], *rows[k]);
    });
    for (std::size_t k = 0; k < rows.size(); ++k) {
      VANTAGE_TRY(const Run run, *std::move(done[k]));
      rows[k]->add(run);
    }
    const std::chrono::duration<double> seconds = std::chrono::steady_clock::now() - begin;
    std::cerr << fmt::format("seed {}, {:g} m/s: {} drives in {:.1f} s\n", params.seed,
                             params.drive.speed, rows.size(), seconds.count());
    return {};
  }

  [[nodiscard]] static Result<Run> localized(const Recording& drive,
                                             const simulation::WorldParams& params,
                                             const Bundle& bundle, const Row& row) {
    const NamedMap& map = *std::ranges::find(all_maps(), row.map, &NamedMap::name);
    VANTAGE_TRY(const Config config,
                config_of(map, row.matcher, mount_of(params.imu), bundle.name()));
    VANTAGE_TRY(Localizer localizer, Localizer::open(bundle, config, test::built_plugins()));
    return localize_scans(std::move(localizer), "the benchmark",
                          drive.inputs(row.aid, row.start_anywhere));
  }

  [[nodiscard]] static std::vector<std::string> head(const std::vector<std::string>& own) {
    std::vector<std::string> all{"map", "matcher"};
    all.insert(all.end(), own.begin(), own.end());
    for (const char* column :
         {"scans", "tracked", "beyond 0.5 m", "mean [cm]", "median [cm]", "p95 [cm]", "worst [cm]",
          "rotation [deg]", "prediction [cm]", "passes", "align [ms]"}) {
      all.emplace_back(column);
    }
    return all;
  }

  [[nodiscard]] static std::vector<std::string> cells(const Row& row,
                                                      const std::vector<std::string>& own) {
    const auto number = [](double x, int digits = 2) { return fmt::format("{:.{}f}", x, digits); };
    const Statistics errors = statistics_of(row.centimetres);
    std::vector<std::string> all{row.map, row.matcher};
    all.insert(all.end(), own.begin(), own.end());
    for (std::string cell :
         {std::to_string(row.scans), std::to_string(row.tracked), std::to_string(row.beyond),
          number(errors.mean), number(errors.median), number(errors.p95), number(errors.max),
          number(statistics_of(row.degrees).mean, 3), number(statistics_of(row.predicted).mean),
          number(statistics_of(row.passes).mean), number(statistics_of(row.align).mean)}) {
      all.push_back(std::move(cell));
    }
    return all;
  }

  const Options& options_;
  std::vector<Row> vlp16_, mid360_;
};

Result<void> run(const Options& options) {
  for (const std::uint64_t seed : options.seeds) VANTAGE_CHECK(check_seed(seed));
  const cli::ThreadLimit threads(options.jobs);
  MotionBench bench(options);
  for (const std::uint64_t seed : options.seeds) VANTAGE_CHECK(bench.add(seed));
  bench.print();
  return {};
}

void declare(Arguments& arguments, Options& options) {
  arguments.program(
      "./dev bench motion",
      "How well a sensor that moves is localized: raw sweeps of simulated drives, with nothing "
      "else, with an IMU, and with odometry; markdown tables.");
  std::vector<std::string> maps;
  for (const NamedMap& map : all_maps()) maps.push_back(map.name);
  arguments.shown("--seeds", options.seeds, "of the worlds, none of configs/simulate", "N,N,...")
      ->delimiter(',');
  arguments
      .shown("--speeds", options.speeds, "of the VLP-16 [m/s]", "V,V,...", CLI::Range(0.1, 30.0))
      ->delimiter(',');
  arguments
      .shown("--matchers", options.matchers, "which", "NAME,NAME,...",
             CLI::IsMember({"ndt", "icp", "gicp"}))
      ->delimiter(',');
  arguments
      .shown("--maps", options.maps, "the whole map, regions of 20 m by surface", "NAME,NAME,...",
             CLI::IsMember(maps))
      ->delimiter(',');
  arguments.add("--length", options.length,
                "of each drive; if left out, one lap, and 90 m of the MID-360", "M",
                CLI::PositiveNumber);
  arguments.flag("--no-mid360", options.no_mid360, "leave out the MID-360 that hangs upside down");
  arguments.shown("-j,--jobs", options.jobs, "threads; results do not depend on it; 0: all", "N");
}

const auto program = table(declare, run);

}  // namespace
}  // namespace vantage::benchmarks

int main(int argc, char** argv) { return vantage::benchmarks::program(argc, argv); }
