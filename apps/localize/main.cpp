// vantage-localize: makes a trajectory from a bundle and recorded scans.
#include <fmt/format.h>

#include <iostream>
#include <nlohmann/json.hpp>

#include "evaluation/json.hpp"
#include "localize/run_recorder.hpp"
#include "terminal/command_line.hpp"
#include "terminal/input_options.hpp"
#include "terminal/progress.hpp"
#include "terminal/table.hpp"
#include "vantage/evaluation/run_files.hpp"

namespace vantage {
namespace {

struct Options {
  std::string config, initial_pose;
  std::optional<double> speed;
  std::filesystem::path out, mcap;
  InputOptions inputs;
  cli::CommonOptions common;
};

void print_summary(const Run& run, const RunSummary& s, const std::filesystem::path& out,
                   const cli::Style& style) {
  std::cout << fmt::format(
      "{} scans ({}): {} tracked, {} lost, found again {} times; {} region switches, {} blocking\n",
      s.scans, run.stamp_rule, s.tracked, s.lost, s.recovered, s.switches, s.blocking_loads);
  if (run.skipped.not_later > 0) {
    std::cout << fmt::format("{} scans stamped no later than the one before were skipped\n",
                             run.skipped.not_later);
  }
  if (run.skipped.incomplete > 0) {
    std::cout << fmt::format("{} incomplete sweeps at the ends of the recording were skipped\n",
                             run.skipped.incomplete);
  }
  if (run.speed) {
    std::cout << fmt::format(
        "replayed {} times faster than recorded: scans late by {:.1f} ms at most\n", *run.speed,
        1e3 * run.seconds_late);
  }
  if (s.outside > 0) {
    std::cout << fmt::format(
        "{} scans began outside every region that has a map; the last map was kept\n", s.outside);
  }
  cli::TextTable table({"", "mean", "median", "p95", "p99", "max"});
  const auto row = [&](const std::string& name, const Statistics& x, int digits,
                       double scale = 1.0) {
    const auto number = [&](double v) { return fmt::format("{:.{}f}", scale * v, digits); };
    table.add(
        {name, number(x.mean), number(x.median), number(x.p95), number(x.p99), number(x.max)});
  };
  if (s.error_m.count > 0) {
    row("error [cm]", s.error_m, 2, 100.0);
    row("error [deg]", s.error_deg, 3);
  }
  row("T_align [ms]", s.align_ms, 2);
  row("stall [ms]", s.stall_ms, 3);
  if (s.search_ms.count > 0) row("search [ms]", s.search_ms, 1);
  row("T_load [ms]", s.load_ms, 2);
  row("T_prepare [ms]", s.prepare_ms, 2);
  row("N_point", s.map_points, 0);
  row("iterations", s.iterations, 1);
  row("fitness", s.fitness, 4);
  row("NVTL", s.nvtl, 4);
  row("coverage", s.coverage, 4);
  row("LCP x 1e6", s.lcp, 4, 1e6);
  row("sigma [cm]", s.sigma_m, 2, 100.0);
  std::cout << '\n' << table.to_string(style) << "\nwritten to " << out.string() << '\n';
}

Result<void> run(const Options& options) {
  if (options.initial_pose.empty() && options.inputs.reference.empty()) {
    return cli::usage_error("no first pose: give --initial-pose (a pose or 'auto') or --reference");
  }
  const cli::ThreadLimit threads(options.common.jobs);
  VANTAGE_TRY(const Config config, load_config(options.config, options.common.overrides));
  VANTAGE_TRY(auto inputs, options.inputs.open());
  inputs.speed = options.speed;
  if (options.initial_pose == "auto") {
    inputs.start_anywhere = true;
  } else if (!options.initial_pose.empty()) {
    VANTAGE_TRY(inputs.initial_pose,
                cli::parse_pose("--initial-pose", options.initial_pose, " or 'auto'"));
  }
  std::optional<RunRecorder> recorder;
  if (!options.mcap.empty()) {
    VANTAGE_TRY(recorder, RunRecorder::create(options.mcap, config, options.common.loader()));
    inputs.observe = [&](const io::StampedScan& scan, const RunScan& result) {
      return recorder->add(scan, result);
    };
  }
  Run run;
  {
    cli::Progress progress("localizing (scans)", options.common.quiet);
    VANTAGE_TRY(run, localize_scans(config, options.common.loader(), inputs,
                                    [&](std::size_t done, std::size_t total) {
                                      progress.update(done, total);
                                    }));
  }
  const RunSummary summary = summarize(run);
  VANTAGE_CHECK(write_run(run, summary, options.out));
  if (recorder) VANTAGE_CHECK(recorder->commit());
  if (options.common.json) {
    std::cout << to_json(run, summary).dump(2) << '\n';
  } else {
    print_summary(run, summary, options.out, options.common.style());
    if (recorder) std::cout << recorder->summary() << '\n';
  }
  return {};
}

}  // namespace
}  // namespace vantage

int main(int argc, char** argv) {
  CLI::App app("Localizes recorded scans against a bundle of region maps.", "vantage localize");
  vantage::Options options;
  app.add_option("CONFIG", options.config, "configuration (TOML)")->required();
  options.inputs.add_to(app, false);
  app.add_option("--out", options.out, "folder for trajectory.tum, scans.csv, summary.json")
      ->type_name("DIR")
      ->required();
  app.add_option(
         "--initial-pose", options.initial_pose,
         "pose of the sensor at the first scan: x,y,z,roll,pitch,yaw [m, rad]; or 'auto' to "
         "look for it in all regions")
      ->type_name("POSE");
  app.add_option("--speed", options.speed,
                 "replay this many times faster than recorded; as fast as possible if left out")
      ->check(CLI::PositiveNumber);
  app.add_option(
         "--mcap", options.mcap,
         "also record the run as an MCAP file, to be opened in Foxglove: map, scans, poses, "
         "diagnostics")
      ->type_name("FILE");
  options.common.add_to(app);
  return vantage::cli::run_program(app, argc, argv, [&] { return vantage::run(options); });
}
