#include "localize/run.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <chrono>
#include <cmath>
#include <limits>
#include <memory>
#include <nlohmann/json.hpp>
#include <thread>
#include <utility>

#include "terminal/command_line.hpp"
#include "vantage/io/read_ahead.hpp"
#include "vantage/io/sensor_trajectory.hpp"
#include "vantage/kit/atomic_file.hpp"

namespace vantage {
namespace {

constexpr double kDegrees = 180.0 / M_PI;
constexpr double kLostMetres = 2.0, kLostDegrees = 5.0;

/// A column of a statistic over the scans for which `value` gives a number.
template <class F>
cli::Statistics over(const Run& run, const F& value) {
  std::vector<double> sample;
  for (const RunScan& scan : run.scans) {
    if (const std::optional<double> x = value(scan)) sample.push_back(*x);
  }
  return cli::statistics_of(sample);
}

PoseError error_of(const Pose& pose, const Pose& truth) {
  const Eigen::AngleAxisd turn(
      Eigen::Quaterniond(pose.rotation * truth.rotation.conjugate()).normalized());
  const Eigen::Vector3d translation = pose.translation - truth.translation;
  return {.metres = translation.norm(),
          .degrees = rotation_between(pose, truth) * kDegrees,
          .translation = translation,
          .rotation = turn.angle() * turn.axis()};
}

/// Share of the errors along the axes within 1, 2 and 3 standard deviations; one of a normal
/// distribution would have 68, 95 and 99.7 %.
std::array<double, 3> within_sigmas(const Run& run, Eigen::Vector3d PoseError::*error,
                                    Eigen::Index first) {
  std::array<double, 3> within{};
  std::size_t errors = 0;
  for (const RunScan& scan : run.scans) {
    if (!is_tracked(scan) || !scan.error || !scan.report.confidence) continue;
    for (Eigen::Index axis = 0; axis < 3; ++axis) {
      const double sigma =
          std::sqrt(scan.report.confidence->covariance(first + axis, first + axis));
      const double size = std::abs(((*scan.error).*error)[axis]);
      ++errors;
      for (std::size_t k = 0; k < 3; ++k) {
        if (size <= static_cast<double>(k + 1) * sigma) within[k] += 1.0;
      }
    }
  }
  for (double& share : within) share /= static_cast<double>(std::max<std::size_t>(errors, 1));
  return within;
}

/// @param step  [m] of the reference's path between the scans that are compared; 0: the next one
RelativeErrors relative_errors(const Run& run, double step) {
  const std::vector<double> way = distances(run);
  const auto compared = [&](std::size_t i) {
    return is_tracked(run.scans[i]) && run.scans[i].reference.has_value();
  };
  std::vector<double> m, deg;
  for (std::size_t i = 0, j = 1; i + 1 < run.scans.size(); ++i) {
    j = std::max(j, i + 1);
    while (j < run.scans.size() && way[j] - way[i] < step) ++j;
    if (j == run.scans.size()) break;
    if (!compared(i) || !compared(j)) continue;
    const auto motion = [](const Pose& from, const Pose& to) { return from.inverse() * to; };
    const Pose truth = motion(*run.scans[i].reference, *run.scans[j].reference);
    const Pose estimate = motion(run.scans[i].report.T_map_scan, run.scans[j].report.T_map_scan);
    m.push_back((truth.inverse() * estimate).translation.norm());
    deg.push_back(rotation_between(truth, estimate) * kDegrees);
  }
  return {.m = cli::statistics_of(m), .deg = cli::statistics_of(deg)};
}

/// As RFC 4180 has it.
std::string quoted(const std::string& text) {
  std::string cell = "\"";
  for (const char c : text) {
    if (c == '"') cell += '"';
    cell += c;
  }
  return cell + '"';
}

/// The scans of a run, the first of which is read at once: the localizer starts at its stamp.
class ScanWindow {
 public:
  static Result<ScanWindow> open(const RunInputs& inputs) {
    ScanWindow scans;
    VANTAGE_TRY(auto source, io::open_scans(inputs.scans));
    scans.source_ = io::read_ahead(std::move(source));
    VANTAGE_TRY(scans.first_, scans.source_->next());
    if (scans.first_ && inputs.window.start > 0.0) {
      VANTAGE_CHECK(scans.source_->seek(scans.first_->stamp + inputs.window.start));
      VANTAGE_TRY(scans.first_, scans.source_->next());
    }
    if (!scans.first_) {
      return fail(ErrorCode::invalid_input,
                  inputs.window.start > 0.0
                      ? fmt::format("no scan is left {} s after the first", inputs.window.start)
                      : "there is no scan",
                  SourceLocation{inputs.scans.path.string(), 0, 0});
    }
    scans.first_stamp_ = scans.first_->stamp;
    if (inputs.window.duration) scans.end_ = scans.first_stamp_ + *inputs.window.duration;
    if (!inputs.window.duration && inputs.window.start <= 0.0) {
      scans.expected_ = scans.source_->describe().scans.value_or(0);
    }
    return scans;
  }

  /// Nothing at the end.
  Result<std::optional<io::StampedScan>> next() {
    if (first_) return std::exchange(first_, std::nullopt);
    VANTAGE_TRY(auto scan, source_->next());
    if (scan && scan->stamp > end_) scan.reset();
    return scan;
  }

  double first_stamp() const { return first_stamp_; }
  const std::string& stamp_rule() const { return source_->describe().stamp_rule; }
  io::SkippedScans skipped() const { return source_->skipped(); }
  /// 0 if nobody knows.
  std::size_t expected() const { return expected_; }

 private:
  std::unique_ptr<io::ScanSource> source_;
  std::optional<io::StampedScan> first_;
  double first_stamp_ = 0.0, end_ = std::numeric_limits<double>::infinity();  // [s]
  std::size_t expected_ = 0;
};

/// Holds scans back until they are due; the clock starts when the object is made.
class Replay {
 public:
  Replay(std::optional<double> speed, double first_stamp)
      : speed_(speed), first_stamp_(first_stamp) {}

  /// @return how late the scan is [s]; 0 without a speed
  double wait_for(double stamp) const {
    if (!speed_) return 0.0;
    const std::chrono::duration<double> due((stamp - first_stamp_) / *speed_);
    std::this_thread::sleep_until(
        begin_ + std::chrono::duration_cast<std::chrono::steady_clock::duration>(due));
    const std::chrono::duration<double> now = std::chrono::steady_clock::now() - begin_;
    return (now - due).count();
  }

 private:
  std::optional<double> speed_;
  double first_stamp_;  // [s]
  std::chrono::steady_clock::time_point begin_ = std::chrono::steady_clock::now();
};

Result<void> start(Localizer& localizer, const RunInputs& inputs, const ScanWindow& scans) {
  std::optional<Pose> first = inputs.initial_pose;
  if (!first && !inputs.start_anywhere && inputs.reference) {
    first = io::pose_at(*inputs.reference, scans.first_stamp());
    if (!first) {
      return fail(
          ErrorCode::invalid_input,
          fmt::format("the reference has no pose at the first scan's stamp, {} s (it runs from {} "
                      "to {} s); {}",
                      scans.first_stamp(), inputs.reference->front().stamp,
                      inputs.reference->back().stamp, scans.stamp_rule()));
    }
  }
  if (first) return localizer.start(*first);
  if (!inputs.start_anywhere) {
    return fail(ErrorCode::invalid_input, "no first pose: give --initial-pose or --reference");
  }
  localizer.start_anywhere();
  return {};
}

Result<RunScan> localize_scan(Localizer& localizer, const RunInputs& inputs,
                              const io::StampedScan& scan) {
  std::optional<Pose> odometry;
  if (inputs.odometry) odometry = io::pose_at(*inputs.odometry, scan.stamp);
  auto report = localizer.localize(
      {.stamp = scan.stamp, .points = scan.points, .odometry = odometry, .seconds = scan.seconds});
  if (!report) return fail(std::move(report).error().during("localizing " + scan.name));
  RunScan done{*std::move(report), scan.dropped, {}, {}};
  if (inputs.reference) done.reference = io::pose_at(*inputs.reference, scan.stamp);
  if (done.reference && done.report.has_pose) {
    done.error = error_of(done.report.T_map_scan, *done.reference);
  }
  return done;
}

std::string cell(const std::optional<double>& x) { return x ? fmt::format("{}", *x) : ""; }

}  // namespace

void InputOptions::add_to(CLI::App& app, bool reference_required) {
  app.add_option("--scans", scans,
                 "folder of PCD, PLY or KITTI .bin scans, ROS bag, MCAP or Velodyne capture")
      ->required();
  app.add_option("--topic", topic, "topic of the scans, where a bag has several");
  app.add_option("--start", window.start, "leave out so many seconds of the recording")
      ->check(CLI::NonNegativeNumber);
  app.add_option("--duration", window.duration, "stop after so many seconds")
      ->check(CLI::PositiveNumber);
  app.add_option("--reference", reference,
                 "true trajectory (TUM, KITTI or ROS bag): errors are measured against it")
      ->required(reference_required);
  app.add_option("--reference-topic", reference_topic, kPoseTopicHelp);
  app.add_option("--odometry", odometry,
                 "odometry (TUM, KITTI or ROS bag) to predict with, instead of constant velocity");
  app.add_option("--odometry-topic", odometry_topic, kPoseTopicHelp);
  app.add_option("--mount", mount, kMountHelp)->type_name("POSE");
  app.add_option("--rate", rate_hz, "scans a second, where files carry no stamps")
      ->check(CLI::PositiveNumber)
      ->capture_default_str();
}

std::vector<double> distances(const Run& run) {
  const bool referenced = std::any_of(run.scans.begin(), run.scans.end(), [](const RunScan& scan) {
    return scan.reference.has_value();
  });
  std::vector<double> way;
  std::optional<Eigen::Vector3d> last;
  double sum = 0.0;
  for (const RunScan& scan : run.scans) {
    std::optional<Eigen::Vector3d> at;
    if (scan.reference) {
      at = scan.reference->translation;
    } else if (!referenced && scan.report.has_pose) {
      at = scan.report.T_map_scan.translation;
    }
    if (last && at) sum += (*at - *last).norm();
    if (at) last = at;
    way.push_back(sum);
  }
  return way;
}

Result<RunInputs> InputOptions::open() const {
  RunInputs inputs{.scans = {.path = scans, .topic = topic, .rate_hz = rate_hz}, .window = window};
  // What is wrong is said before any work is done.
  VANTAGE_TRY(const auto source, io::open_scans(inputs.scans));
  io::SensorFrame sensor{.name = source->describe().frame, .scans = scans, .T_child_sensor = {}};
  if (!mount.empty()) {
    VANTAGE_TRY(sensor.T_child_sensor, cli::parse_pose("--mount", mount));
  }
  if (!reference.empty()) {
    VANTAGE_TRY(inputs.reference,
                io::read_sensor_trajectory({reference, reference_topic, rate_hz}, sensor));
  }
  if (!odometry.empty()) {
    VANTAGE_TRY(inputs.odometry,
                io::read_sensor_trajectory({odometry, odometry_topic, rate_hz}, sensor));
  }
  return inputs;
}

Result<Run> localize_scans(const Config& config, const PluginLoader& loader,
                           const RunInputs& inputs, const ScanProgress& progress) {
  VANTAGE_TRY(auto localizer, Localizer::open(config, loader));
  return localize_scans(std::move(localizer), config.file, inputs, progress);
}

Result<Run> localize_scans(Localizer localizer, const std::string& config, const RunInputs& inputs,
                           const ScanProgress& progress) {
  VANTAGE_TRY(ScanWindow scans, ScanWindow::open(inputs));
  VANTAGE_CHECK(start(localizer, inputs, scans));
  Run run{.config = config,
          .stamp_rule = scans.stamp_rule(),
          .index = localizer.index(),
          .scans = {},
          .speed = inputs.speed};
  if (progress) progress(0, scans.expected());
  const Replay replay(inputs.speed, scans.first_stamp());
  while (true) {
    VANTAGE_TRY(const auto scan, scans.next());
    if (!scan) break;
    run.seconds_late = std::max(run.seconds_late, replay.wait_for(scan->stamp));
    VANTAGE_TRY(RunScan done, localize_scan(localizer, inputs, *scan));
    if (inputs.observe) VANTAGE_CHECK(inputs.observe(*scan, done));
    run.scans.push_back(std::move(done));
    if (progress) progress(run.scans.size(), scans.expected());
  }
  run.skipped = scans.skipped();
  return run;
}

RunSummary summarize(const Run& run) {
  using Number = std::optional<double>;
  RunSummary s;
  s.scans = run.scans.size();
  for (const RunScan& scan : run.scans) {
    s.tracked += is_tracked(scan) ? 1 : 0;
    s.recovered += scan.report.recovered ? 1 : 0;
    s.switches += scan.report.switched ? 1 : 0;
    s.blocking_loads += scan.report.blocked ? 1 : 0;
    s.outside += scan.report.outside ? 1 : 0;
    s.dropped_points += scan.report.dropped_points + scan.dropped_by_reader;
    s.held_bytes = std::max(s.held_bytes, scan.report.held_bytes);
    if (scan.error && (scan.error->metres > kLostMetres || scan.error->degrees > kLostDegrees)) {
      ++s.far_off;
      s.tracked_far_off += is_tracked(scan) ? 1 : 0;
    }
  }
  s.lost = s.scans - s.tracked;
  // The first map is made ready at the start, not switched to.
  if (!run.scans.empty() && run.scans.front().report.switched) --s.switches;

  const auto error = [&](double PoseError::*member) {
    return over(run, [=](const RunScan& scan) -> Number {
      if (!scan.error || !is_tracked(scan)) return {};
      return (*scan.error).*member;
    });
  };
  s.error_m = error(&PoseError::metres);
  s.error_deg = error(&PoseError::degrees);
  s.relative_frame = relative_errors(run, 0.0);
  s.relative_10m = relative_errors(run, 10.0);

  s.align_ms = over(run, [](const RunScan& x) -> Number { return 1e3 * x.report.seconds_align; });
  s.stall_ms = over(run, [](const RunScan& x) -> Number { return 1e3 * x.report.seconds_stall; });
  s.search_ms = over(run, [](const RunScan& x) -> Number {
    if (x.report.seconds_search <= 0.0) return {};
    return 1e3 * x.report.seconds_search;
  });
  const auto at_switches = [&](double ScanReport::*member) {
    return over(run, [=](const RunScan& x) -> Number {
      if (!x.report.switched) return {};
      return 1e3 * x.report.*member;
    });
  };
  s.load_ms = at_switches(&ScanReport::seconds_load);
  s.prepare_ms = at_switches(&ScanReport::seconds_prepare);
  s.map_points = over(
      run, [](const RunScan& x) -> Number { return static_cast<double>(x.report.map_points); });

  const auto tracked = [&](const auto& value) {
    return over(run, [&](const RunScan& x) -> Number {
      if (!is_tracked(x) || !x.report.alignment) return {};
      return value(x.report);
    });
  };
  s.iterations =
      tracked([](const ScanReport& r) { return static_cast<double>(r.alignment->iterations); });
  s.fitness = tracked([](const ScanReport& r) { return r.alignment->score.fitness; });
  s.nvtl = tracked([](const ScanReport& r) { return r.alignment->score.nvtl; });
  s.coverage = tracked([](const ScanReport& r) { return r.alignment->score.coverage; });
  s.lcp = tracked([](const ScanReport& r) { return r.lcp; });
  s.sigma_m = tracked([](const ScanReport& r) { return r.confidence->sigma_translation[0]; });
  s.within_sigmas_translation = within_sigmas(run, &PoseError::translation, 0);
  s.within_sigmas_rotation = within_sigmas(run, &PoseError::rotation, 3);
  return s;
}

nlohmann::ordered_json to_json(const Run& run, const RunSummary& s) {
  nlohmann::ordered_json json{
      {"config", run.config},
      {"stamps", run.stamp_rule},
      {"map", {{"points", run.index.map_points}, {"regions", run.index.partition.size()}}},
      {"scans",
       {{"total", s.scans},
        {"tracked", s.tracked},
        {"lost", s.lost},
        {"recovered", s.recovered},
        {"outside_every_region", s.outside},
        {"switches", s.switches},
        {"blocking_loads", s.blocking_loads},
        {"dropped_points", s.dropped_points},
        {"skipped",
         {{"not_later", run.skipped.not_later}, {"incomplete", run.skipped.incomplete}}}}},
      {"T_align_ms", cli::to_json(s.align_ms)},
      {"stall_ms", cli::to_json(s.stall_ms)},
      {"search_ms", cli::to_json(s.search_ms)},
      {"T_load_ms", cli::to_json(s.load_ms)},
      {"T_prepare_ms", cli::to_json(s.prepare_ms)},
      {"held_bytes_max", s.held_bytes},
      {"N_point", cli::to_json(s.map_points)},
      {"iterations", cli::to_json(s.iterations)},
      {"fitness", cli::to_json(s.fitness)},
      {"NVTL", cli::to_json(s.nvtl)},
      {"coverage", cli::to_json(s.coverage)},
      {"LCP", cli::to_json(s.lcp)},
      {"sigma_m", cli::to_json(s.sigma_m)}};
  if (run.speed) {
    json["replay"] = {{"speed", *run.speed}, {"late_ms_max", 1e3 * run.seconds_late}};
  }
  if (s.error_m.count > 0) {
    json["error_m"] = cli::to_json(s.error_m);
    json["error_deg"] = cli::to_json(s.error_deg);
    const auto relative = [](const RelativeErrors& r) {
      return nlohmann::ordered_json{{"m", cli::to_json(r.m)}, {"deg", cli::to_json(r.deg)}};
    };
    json["relative_error"] = {{"next_scan", relative(s.relative_frame)},
                              {"10m", relative(s.relative_10m)}};
    json["scans_beyond_2m_or_5deg"] = s.far_off;
    json["tracked_scans_beyond_2m_or_5deg"] = s.tracked_far_off;
    json["errors_within_1_2_3_sigma"] = {{"translation", s.within_sigmas_translation},
                                         {"rotation", s.within_sigmas_rotation}};
  }
  return json;
}

io::Trajectory trajectory_of(const Run& run) {
  io::Trajectory trajectory;
  for (const RunScan& scan : run.scans) {
    if (is_tracked(scan)) trajectory.push_back({scan.report.stamp, scan.report.T_map_scan});
  }
  return trajectory;
}

std::string to_csv(const Run& run) {
  std::string csv =
      "stamp,tracking,recovered,region,switched,outside,blocked,N_point,N_scan,N_dropped,T_align_"
      "ms,"
      "stall_ms,search_ms,T_load_ms,T_prepare_ms,iterations,termination,fitness,NVTL,coverage,LCP,"
      "sigma_m,sigma_deg,degenerate,correction_m,x,y,z,qx,qy,qz,qw,error_m,error_deg,"
      "distance_m,ref_x,ref_y,ref_z,ref_qx,ref_qy,ref_qz,ref_qw,held_bytes,reason\n";
  const std::vector<double> way = distances(run);
  for (std::size_t i = 0; i < run.scans.size(); ++i) {
    const RunScan& scan = run.scans[i];
    const ScanReport& r = scan.report;
    const auto& a = r.alignment;
    const auto score = [&](double ScanScore::*member) {
      return cell(a ? std::optional(a->score.*member) : std::nullopt);
    };
    const auto pose = [](const std::optional<Pose>& T) {
      if (!T) return std::string(6, ',');
      const auto& [q, t] = *T;
      return fmt::format("{},{},{},{},{},{},{}", t.x(), t.y(), t.z(), q.x(), q.y(), q.z(), q.w());
    };
    csv += fmt::format("{:.9f},{},{:d},{},{:d},{:d},{:d},{},{},{},", r.stamp, to_string(r.tracking),
                       r.recovered, run.index.partition[r.region].label, r.switched, r.outside,
                       r.blocked, r.map_points, r.scan_points,
                       r.dropped_points + scan.dropped_by_reader);
    csv += fmt::format("{:.4f},{:.4f},{:.4f},{:.4f},{:.4f},{},{},{},{},{},{},",
                       1e3 * r.seconds_align, 1e3 * r.seconds_stall, 1e3 * r.seconds_search,
                       1e3 * r.seconds_load, 1e3 * r.seconds_prepare,
                       a ? std::to_string(a->iterations) : "", a ? to_string(a->termination) : "",
                       score(&ScanScore::fitness), score(&ScanScore::nvtl),
                       score(&ScanScore::coverage), cell(a ? std::optional(r.lcp) : std::nullopt));
    const auto& c = r.confidence;
    csv += fmt::format(
        "{},{},{},{},", cell(c ? std::optional(c->sigma_translation[0]) : std::nullopt),
        cell(c ? std::optional(c->sigma_rotation[0] * kDegrees) : std::nullopt),
        c ? std::to_string(c->degenerate) : "",
        cell(a && r.has_pose
                 ? std::optional(
                       (a->T_map_scan.translation - r.T_map_scan_predicted.translation).norm())
                 : std::nullopt));
    csv += fmt::format("{},{},{},{:.4f},{},{},{}\n",
                       pose(r.has_pose ? std::optional(r.T_map_scan) : std::nullopt),
                       cell(scan.error ? std::optional(scan.error->metres) : std::nullopt),
                       cell(scan.error ? std::optional(scan.error->degrees) : std::nullopt), way[i],
                       pose(scan.reference), r.held_bytes, quoted(r.reason));
  }
  return csv;
}

Result<void> write_run(const Run& run, const RunSummary& summary,
                       const std::filesystem::path& folder) {
  std::error_code error;
  std::filesystem::create_directories(folder, error);
  if (error) {
    return fail(ErrorCode::io_failure, "cannot create the output folder: " + error.message(),
                SourceLocation{folder.string(), 0, 0});
  }
  // All three are written before the first appears under its name.
  VANTAGE_TRY(auto csv, io::OutputFile::create(folder / "scans.csv"));
  VANTAGE_CHECK(csv.write(to_csv(run)));
  VANTAGE_TRY(auto json, io::OutputFile::create(folder / "summary.json"));
  VANTAGE_CHECK(json.write(to_json(run, summary).dump(2) + "\n"));
  VANTAGE_CHECK(io::write_tum(folder / "trajectory.tum", trajectory_of(run)));
  VANTAGE_CHECK(csv.commit());
  return json.commit();
}

}  // namespace vantage
