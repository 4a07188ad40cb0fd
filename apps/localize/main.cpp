// vantage-localize: makes a trajectory from a bundle and recorded scans.
#include <fmt/format.h>

#include <cmath>
#include <iostream>
#include <nlohmann/json.hpp>

#include "checks/notes.hpp"
#include "checks/trials.hpp"
#include "evaluation/json.hpp"
#include "io/text.hpp"
#include "localize/run_page.hpp"
#include "localize/run_recorder.hpp"
#include "terminal/command_line.hpp"
#include "terminal/freed_memory.hpp"
#include "terminal/input_options.hpp"
#include "terminal/option_values.hpp"
#include "terminal/progress.hpp"
#include "terminal/table.hpp"
#include "vantage/engine/predicted_errors.hpp"
#include "vantage/evaluation/clock_offset.hpp"
#include "vantage/evaluation/metrics.hpp"
#include "vantage/evaluation/run_files.hpp"
#include "vantage/kit/atomic_file.hpp"
#include "vantage/kit/json_text.hpp"

namespace vantage {
namespace {

struct Options {
  std::string config, initial_pose, imu_offset;
  std::optional<double> speed;
  std::filesystem::path out, mcap, html;
  InputOptions inputs;
  cli::CommonOptions common;
};

/// ", relocalized twice", or nothing.
std::string relocalized(std::size_t times) {
  if (times == 0) return {};
  if (times == 1) return ", relocalized once";
  return times == 2 ? ", relocalized twice"
                    : fmt::format(", relocalized {} times", cli::grouped(times));
}

/// What there is to say of a run, a sentence each.
std::vector<std::string> remarks_on(const RunInfo& run, const RunSummary& s) {
  std::vector<std::string> remarks;
  remarks.push_back(
      fmt::format("{} ({}): {} tracked, {} uncertain, {} lost{}; {}, {} blocking",
                  cli::counted(s.scans, "scan"), run.stamp_rule, cli::grouped(s.tracked),
                  cli::grouped(s.count("uncertain")), cli::grouped(s.count("lost")),
                  relocalized(s.count("recovered")),
                  cli::counted(s.count("switched"), "region switch", "region switches"),
                  cli::grouped(s.count("blocked"))));
  if (run.timed == 0) {
    remarks.push_back("the points have no times: sweeps of a moving sensor stay distorted");
  }
  if (run.skipped.not_later > 0) {
    remarks.push_back(fmt::format("{} stamped no later than the one before {} skipped",
                                  cli::counted(run.skipped.not_later, "scan"),
                                  cli::form(run.skipped.not_later, "was", "were")));
  }
  if (run.skipped.incomplete > 0) {
    remarks.push_back(fmt::format("{} at the ends of the recording {} skipped",
                                  cli::counted(run.skipped.incomplete, "incomplete sweep"),
                                  cli::form(run.skipped.incomplete, "was", "were")));
  }
  if (run.prior) {
    remarks.push_back(fmt::format("{} of {} had a prior from {}", cli::grouped(run.prior->scans),
                                  cli::counted(s.scans, "scan"), run.prior->source));
    remarks.insert(remarks.end(), run.prior->notes.begin(), run.prior->notes.end());
  }
  if (const std::size_t doubted = s.count("doubted"); doubted > 0) {
    remarks.push_back(fmt::format(
        "odometry contradicted the motion that is known before {}, and did not always count",
        cli::counted(doubted, "scan")));
  }
  if (run.speed) {
    remarks.push_back(
        fmt::format("replayed {} times faster than recorded: scans late by {:.1f} ms at most",
                    *run.speed, 1e3 * run.seconds_late));
  }
  if (const std::size_t outside = s.count("outside"); outside > 0) {
    remarks.push_back(
        fmt::format("{} began outside every region that has a map; the last map was kept",
                    cli::counted(outside, "scan")));
  }
  if (const auto& met = s.predictions) {
    remarks.push_back(fmt::format("{} of {} {} what the bundle promises for 95 % of scans",
                                  cli::grouped(met->kept), cli::counted(met->errors, "error"),
                                  cli::form(met->errors, "keeps", "keep")));
    if (met->unpromised > 0) {
      remarks.back() +=
          fmt::format("; {} {} promised nothing", cli::counted(met->unpromised, "scan"),
                      cli::form(met->unpromised, "was", "were"));
    }
    if (met->places > 2) {
      remarks.back() += fmt::format(
          "; over {} places of 10 m, expected and measured errors have a rank "
          "correlation of {:.2f}",
          met->places, met->rank_correlation);
    }
  }
  return remarks;
}

void print_summary(const std::vector<std::string>& remarks, const RunSummary& s,
                   const std::filesystem::path& out, const cli::Style& style) {
  for (const std::string& remark : remarks) std::cout << remark << '\n';
  cli::TextTable table({"", "mean", "median", "p95", "p99", "max"});
  for (const Metric* metric : metrics_by_group()) {
    const Statistics x = s[metric->key];
    if (metric->is_count() || x.count == 0) continue;
    std::vector<std::string> row{heading(*metric)};
    for (const double value : {x.mean, x.median, x.p95, x.p99, x.max}) {
      row.push_back(shown(*metric, value));
    }
    table.add(std::move(row));
  }
  std::cout << '\n' << table.to_string(style) << "\nwritten to " << out.string() << '\n';
}

/// Nothing if the run's relocalizer made the bundle's index of places, or the bundle has no index.
Result<std::string> note_on_index(const Bundle& bundle, const Config& config) {
  VANTAGE_TRY(const auto made_by, bundle.indexed_by());
  if (!made_by || !config.relocalizer || made_by->plugin == config.relocalizer->plugin) {
    return std::string();
  }
  return fmt::format(
      "the bundle's index of places is that of '{}': the first search makes one for '{}' from the "
      "bundle's points\n",
      made_by->plugin, config.relocalizer->plugin);
}

/// Moves the samples of the IMU to the clock of the scans.
Result<void> set_clock(RunInputs& inputs, const std::string& offset, const Bundle& bundle,
                       const Config& config, const PluginLoader& plugins) {
  ClockOffset clock;
  if (offset == "auto") {
    VANTAGE_TRY(auto localizer, Localizer::open(bundle, config, plugins));
    VANTAGE_TRY(clock, measure_clock_offset(std::move(localizer), inputs));
    std::cerr << fmt::format(
        "the stamps of the IMU get {:+.4f} s (its turns resemble those of the "
        "scans by {:.3f})\n",
        clock.seconds, clock.correlation);
  } else {
    const auto seconds = io::parse_number<double>(offset);
    if (!seconds || !std::isfinite(*seconds)) {
      return cli::usage_error("--imu-offset must be a number of seconds or 'auto', and is '" +
                              offset + "'");
    }
    clock.seconds = *seconds;
  }
  for (ImuSample& sample : inputs.imu->samples) sample.stamp += clock.seconds;
  return {};
}

/// Tries why most scans were not tracked.
/// @param began  whether the first scan was tracked
/// @param place  whether the map may be that of another place
Result<std::optional<checks::Note>> cause_of_loss(const Bundle& bundle, const Config& config,
                                                  const RunInputs& inputs,
                                                  const PluginLoader& plugins, bool began,
                                                  bool place) {
  VANTAGE_TRY(const auto read, first_scans(inputs, checks::kScansToTry));
  const std::vector<io::StampedScan>& first = read.scans;
  VANTAGE_TRY(const checks::Fit fit,
              checks::fit_of(bundle, config, plugins, first, samples_of(inputs)));
  VANTAGE_TRY(auto note, checks::try_changes(bundle, config, plugins, first, fit));
  if (!note && place) note = checks::note_on_place(fit);
  if (note || began || inputs.start_anywhere || 2 * fit.tracked < first.size()) return note;
  const Eigen::Vector3d& at = fit.first_tracked->translation;
  return std::optional<checks::Note>(
      {fmt::format("looked for anywhere, the sensor is found at x {:.1f}, y {:.1f}, z {:.1f} at "
                   "scan {}",
                   at.x(), at.y(), at.z(), fit.first + 1),
       "the first pose is wrong; give --initial-pose auto"});
}

/// What is suspicious; looks for the cause if most scans were not tracked.
/// @param began  whether the first scan was tracked
Result<std::vector<checks::Note>> suspicions(const RunSummary& summary, bool began,
                                             const checks::ScanFacts& scans, const Bundle& bundle,
                                             const Config& config, const RunInputs& inputs,
                                             const PluginLoader& plugins) {
  const bool imu = inputs.imu.has_value();
  VANTAGE_TRY(auto notes, checks::notes_in(bundle));
  const auto add = [&](std::vector<checks::Note> more) {
    notes.insert(notes.end(), more.begin(), more.end());
  };
  add(notes_on(scans, config, imu));
  const auto reach = checks::notes_on_reach(config);
  std::optional<checks::Note> cause;
  if (notes.empty() && 10 * summary.tracked < 9 * summary.scans) {
    VANTAGE_TRY(cause, cause_of_loss(bundle, config, inputs, plugins, began,
                                     summary.tracked == 0 && reach.empty()));
  }
  add(reach);
  if (cause) {
    notes.push_back(*std::move(cause));
  } else {
    add(notes_on_sensor(scans, config, imu));
  }
  if (const Statistics error = summary["error_m"]; error.count > 0) {
    if (auto note = checks::note_on_reference(error.min, error.median, error.max)) {
      notes.push_back(*std::move(note));
    }
  }
  return notes;
}

/// A file in a folder that is made if need be.
Result<io::OutputFile> create_with_folder(const std::filesystem::path& path) {
  std::error_code ignored;  // creating the file says what is wrong
  if (path.has_parent_path()) std::filesystem::create_directories(path.parent_path(), ignored);
  return io::OutputFile::create(path);
}

Result<void> run(const CLI::App& app, const Options& options) {
  if (options.initial_pose.empty() && options.inputs.prior.empty() &&
      options.inputs.reference.empty()) {
    return cli::usage_error(
        "no first pose: give --initial-pose (a pose or 'auto'), --prior or --reference");
  }
  if (!options.imu_offset.empty() && options.inputs.imu.empty()) {
    return cli::usage_error("--imu-offset is given without --imu");
  }
  const bool anywhere = options.initial_pose == "auto";
  std::optional<Pose> initial_pose;
  if (!options.initial_pose.empty() && !anywhere) {
    VANTAGE_TRY(initial_pose,
                cli::parse_pose("--initial-pose", options.initial_pose, " or 'auto'"));
  }
  const cli::ThreadLimit threads(options.common.jobs);
  VANTAGE_TRY(const Config config, load_config(options.config, options.common.overrides));
  VANTAGE_CHECK(cli::check_outputs(app, config));
  VANTAGE_TRY(auto inputs, options.inputs.open(config.map ? config.map->files
                                                          : std::vector<std::filesystem::path>()));
  inputs.speed = options.speed;
  checks::print(std::cerr, checks::notes_on_damage(damaged_besides_scans(inputs)));
  inputs.start_anywhere = anywhere;
  inputs.initial_pose = initial_pose;
  const PluginLoader plugins = options.common.loader();
  VANTAGE_TRY(const Bundle bundle, Bundle::open(config, plugins, "localization"));
  if (!options.imu_offset.empty()) {
    VANTAGE_CHECK(set_clock(inputs, options.imu_offset, bundle, config, plugins));
  }
  VANTAGE_TRY(auto localizer, Localizer::open(bundle, config, plugins));
  VANTAGE_TRY(const auto predicted, PredictedErrors::of_bundle(bundle));
  if (!options.common.quiet) {
    VANTAGE_TRY(const std::string index, note_on_index(bundle, config));
    std::cerr << index;
  }
  const double max_risk = localizer.params().max_risk;
  std::optional<io::OutputFile> html;
  if (!options.html.empty()) {
    VANTAGE_TRY(html, create_with_folder(options.html));
  }
  std::optional<RunWriter> writer;  // from the first scan on: a run without one leaves nothing
  RunSummarizer summarizer(options.out);
  RunPage page(options.out);
  checks::ScanSurvey survey;
  std::optional<RunRecorder> recorder;
  if (!options.mcap.empty()) {
    VANTAGE_TRY(recorder, RunRecorder::create(options.mcap, bundle, config.file));
  }
  std::optional<bool> began;  // whether the first scan was tracked
  const auto take = [&](const io::StampedScan& scan, RunScan&& result) -> Result<void> {
    if (!began) began = result.report.tracking == Tracking::tracked;
    if (predicted) predict(result, *predicted);
    if (recorder) VANTAGE_CHECK(recorder->add(scan, result));
    survey.offer(scan);
    if (!writer) {
      VANTAGE_TRY(writer, RunWriter::create(options.out));
    }
    VANTAGE_CHECK(summarizer.add(result));
    if (html) VANTAGE_CHECK(page.add(result));
    return writer->add(result);
  };
  RunInfo run;
  {
    cli::Progress progress("localizing (scans)", options.common.quiet);
    VANTAGE_TRY(run, localize_each(std::move(localizer), config.file, inputs, take,
                                   [&](std::size_t done, std::size_t total) {
                                     progress.update(done, total);
                                   }));
  }
  VANTAGE_TRY(const RunSummary summary, summarizer.summary());
  VANTAGE_CHECK(writer->commit(run, summary));
  if (recorder) VANTAGE_CHECK(recorder->commit());
  const std::vector<std::string> remarks = remarks_on(run, summary);
  if (options.common.json) {
    std::cout << json_text(to_json(run, summary));
  } else {
    print_summary(remarks, summary, options.out, options.common.style());
    if (recorder) std::cout << recorder->summary() << '\n';
  }
  VANTAGE_TRY(const auto notes, suspicions(summary, began.value_or(false), survey.facts(), bundle,
                                           config, inputs, plugins));
  checks::print(std::cerr, notes);
  if (html) {
    VANTAGE_TRY(const std::string text, page.html({.run = run,
                                                   .summary = summary,
                                                   .remarks = remarks,
                                                   .notes = notes,
                                                   .regions = *bundle.directory(),
                                                   .max_risk = max_risk,
                                                   .reference = inputs.reference.has_value()}));
    VANTAGE_CHECK(html->write(text));
    VANTAGE_CHECK(html->commit());
    if (!options.common.json) std::cout << "report: " << options.html.string() << '\n';
  }
  if (run.failure) {
    return fail(Error(*run.failure)
                    .during(fmt::format("after {}, {} written", cli::counted(summary.scans, "scan"),
                                        cli::form(summary.scans, "which is", "which are"))));
  }
  if (summary.tracked == 0) {
    return fail(ErrorCode::too_few_matches,
                fmt::format("none of the {} scans was tracked", summary.scans),
                SourceLocation{options.inputs.scans.string(), 0, 0});
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
  app.add_option(
         "--imu-offset", options.imu_offset,
         "seconds to add to the stamps of the IMU; 'auto' finds them by comparing its turns "
         "with those of the first minute, which is localized without it")
      ->type_name("SECONDS");
  app.add_option("--speed", options.speed,
                 "replay this many times faster than recorded; as fast as possible if left out")
      ->check(vantage::cli::positive_number());
  app.add_option(
         "--mcap", options.mcap,
         "also record the run as an MCAP file, to be opened in Foxglove: map, scans, poses, "
         "diagnostics; and beside it a layout, FILE with the suffix .foxglove.json")
      ->type_name("FILE");
  app.add_option("--html", options.html,
                 "write a page about the run: verdict, drive, risk, fit, times, memory")
      ->type_name("FILE");
  options.common.add_to(app);
  vantage::cli::keep_only_scan_buffers();
  return vantage::cli::run_program(app, argc, argv, [&] { return vantage::run(app, options); });
}
