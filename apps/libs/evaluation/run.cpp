#include "vantage/evaluation/run.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <chrono>
#include <cmath>
#include <limits>
#include <memory>
#include <thread>
#include <utility>

#include "evaluation/degrees.hpp"
#include "vantage/io/read_ahead.hpp"

namespace vantage {
namespace {

PoseError error_of(const Pose& pose, const Pose& truth) {
  const Eigen::AngleAxisd turn(
      Eigen::Quaterniond(pose.rotation * truth.rotation.conjugate()).normalized());
  const Eigen::Vector3d translation = pose.translation - truth.translation;
  return {.metres = translation.norm(),
          .degrees = rotation_between(pose, truth) * kDegrees,
          .translation = translation,
          .rotation = turn.angle() * turn.axis()};
}

/// The scans of a run. The first is read at once, because the localizer starts at its stamp.
class ScanWindow {
 public:
  static Result<ScanWindow> open(const RunInputs& inputs) {
    ScanWindow scans;
    VANTAGE_TRY(auto source, inputs.opened ? inputs.opened->take() : io::open_scans(inputs.scans));
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

  Result<void> seek(double stamp) { return source_->seek(stamp); }

  double first_stamp() const { return first_stamp_; }
  /// The end of the window [s]; infinite if the recording ends it.
  double end() const { return end_; }
  const io::ScanDescription& describe() const { return source_->describe(); }
  const std::string& stamp_rule() const { return describe().stamp_rule; }
  io::SkippedScans skipped() const { return source_->skipped(); }
  /// The number of scans; 0 if it is unknown.
  std::size_t expected() const { return expected_; }

 private:
  std::unique_ptr<io::ScanSource> source_;
  std::optional<io::StampedScan> first_;
  double first_stamp_ = 0.0, end_ = std::numeric_limits<double>::infinity();  // [s]
  std::size_t expected_ = 0;
};

/// Holds scans back until they are due. The clock starts when the object is made.
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

/// An input of a run, and when it was recorded.
struct Recorded {
  std::string lacking, holding;  ///< "a prior", "the prior has poses"
  double first, last;            ///< stamps [s]
  std::string source = {};       ///< the file or topic, if known
};

/// The inputs that scans are to have something of.
std::vector<Recorded> recorded_in(const RunInputs& inputs) {
  std::vector<Recorded> all;
  if (inputs.priors) {
    const auto& priors = inputs.priors->priors;
    all.push_back({"a prior", "the prior has poses", priors.front().stamp, priors.back().stamp,
                   inputs.priors->source});
  }
  if (inputs.imu) {
    const auto& samples = inputs.imu->samples;
    all.push_back({"samples of the IMU", "the IMU has samples", samples.front().stamp,
                   samples.back().stamp, inputs.imu->source});
  }
  const auto add = [&](const std::optional<io::Trajectory>& poses, const char* name) {
    if (!poses || poses->empty()) return;
    all.push_back({fmt::format("a pose of the {}", name), fmt::format("the {} has poses", name),
                   poses->front().stamp, poses->back().stamp});
  };
  add(inputs.odometry, "odometry");
  add(inputs.reference, "reference");
  return all;
}

/// When scans are: from the first to the last, or not later than that [s].
struct Span {
  double first, last;
  bool is_whole = true;  // not a limit, but the time of the last scan

  [[nodiscard]] bool meets(double begin, double end) const noexcept {
    constexpr double kTolerance = 1e-3;  // [s], as that of io::pose_at
    return end >= first - kTolerance && begin <= last + kTolerance;
  }
};

/// Why stamps of two inputs may differ: one of them has another unit, or another clock.
std::string cause_of_difference(const Recorded& one, Span scans) {
  constexpr double kHour = 3600.0, kDay = 24.0 * kHour;  // [s]
  constexpr double kLeast =
      0.5;  // that an input spans: in too large a unit, all are one moment [s]
  constexpr std::array<std::pair<const char*, double>, 3> kUnits{
      {{"milliseconds", 1e3}, {"microseconds", 1e6}, {"nanoseconds", 1e9}}};
  const Span at{scans.first, std::isinf(scans.last) ? scans.first + kHour : scans.last};
  for (const auto& [name, units] : kUnits) {
    if (one.last - one.first >= kLeast * units && at.meets(one.first / units, one.last / units)) {
      return fmt::format("; its stamps seem to be in {}, and stamps are in seconds", name);
    }
    if (at.last - at.first >= kLeast * units &&
        Span{at.first / units, at.last / units}.meets(one.first, one.last)) {
      return fmt::format("; the stamps of the scans seem to be in {}, and stamps are in seconds",
                         name);
    }
  }
  if (std::abs(one.first - scans.first) < kDay) return {};
  return "; the two have different clocks, such as the time since 1970 and the time since a "
         "computer started";
}

Error lacking(const Recorded& one, Span scans, const std::string& stamp_rule) {
  std::optional<SourceLocation> where;
  if (!one.source.empty()) where = SourceLocation{one.source, 0, 0};
  const bool is_before = one.last < scans.first;
  const std::string when =
      is_before || !scans.is_whole
          ? fmt::format("the scans begin at {} s", scans.first)
          : fmt::format("the scans run from {} to {} s", scans.first, scans.last);
  return {.code = ErrorCode::invalid_input,
          .message =
              fmt::format("no scan has {}: {} from {} to {} s, {}; {}{}", one.lacking, one.holding,
                          one.first, one.last, when, stamp_rule, cause_of_difference(one, scans)),
          .where = std::move(where),
          .context = {}};
}

/// Finds an input that is over before the scans begin, or begins after they end.
Result<void> check_overlap(const RunInputs& inputs, Span scans, const std::string& stamp_rule) {
  for (const Recorded& one : recorded_in(inputs)) {
    if (!scans.meets(one.first, one.last)) return fail(lacking(one, scans, stamp_rule));
  }
  return {};
}

Result<void> start(Localizer& localizer, const RunInputs& inputs, const ScanWindow& scans) {
  std::optional<Pose> first = inputs.initial_pose;
  const bool search = inputs.start_anywhere || inputs.priors.has_value();
  if (!first && !search && inputs.reference) {
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
  if (!search) {
    return fail(ErrorCode::invalid_input,
                "no first pose: give --initial-pose, --prior or --reference");
  }
  localizer.start_anywhere();
  return {};
}

AlertLimit alert_limit_of(const Localizer& localizer) {
  const LocalizerParams& params = localizer.params();
  return {.metres = params.alert_limit, .degrees = params.alert_limit_deg};
}

/// Gives the localizer the samples of motion in time for each scan, as a robot would.
class MotionFeed {
 public:
  explicit MotionFeed(const RunInputs& inputs) : inputs_(inputs) {}

  /// Adds what was measured until the end of a sweep, and the next sample of each, because motion
  /// is interpolated; a robot has it a moment later.
  Result<void> until(double end, Localizer& localizer) {
    if (inputs_.odometry) {
      VANTAGE_CHECK(add(*inputs_.odometry, next_pose_, end, [&](const io::StampedPose& one) {
        return localizer.add(OdometrySample{one.stamp, one.pose});
      }));
    }
    if (!inputs_.imu) return {};
    return add(inputs_.imu->samples, next_imu_, end,
               [&](const ImuSample& one) { return localizer.add(one); });
  }

 private:
  template <class Sample, class Add>
  static Result<void> add(const std::vector<Sample>& samples, std::size_t& next, double end,
                          const Add& give) {
    constexpr double kSoon = 0.1;  // [s]
    for (bool beyond = false; next < samples.size() && !beyond; ++next) {
      if (samples[next].stamp > end + kSoon) break;
      beyond = samples[next].stamp >= end;
      VANTAGE_CHECK(give(samples[next]));
    }
    return {};
  }

  const RunInputs& inputs_;
  std::size_t next_pose_ = 0, next_imu_ = 0;
};

Result<RunScan> localize_scan(Localizer& localizer, const RunInputs& inputs, MotionFeed& motion,
                              const io::StampedScan& scan, const std::optional<PosePrior>& prior) {
  const double sweep =
      scan.seconds.empty() ? 0.0 : static_cast<double>(std::ranges::max(scan.seconds));
  VANTAGE_CHECK(motion.until(scan.stamp + sweep, localizer));
  const auto begin = std::chrono::steady_clock::now();
  auto report = localizer.localize(
      {.stamp = scan.stamp, .points = scan.points, .seconds = scan.seconds, .prior = prior});
  const std::chrono::duration<double> took = std::chrono::steady_clock::now() - begin;
  if (!report) return fail(std::move(report).error().during("localizing " + scan.name));
  RunScan done{.report = *std::move(report),
               .seconds = took.count(),
               .dropped_by_reader = scan.dropped,
               .reference = {},
               .error = {},
               .prediction_error = {}};
  if (inputs.reference) done.reference = io::pose_at(*inputs.reference, scan.stamp);
  if (done.reference && done.report.has_pose) {
    done.error = error_of(done.report.T_map_scan, *done.reference);
    if (done.report.passes > 0) {
      done.prediction_error = error_of(done.report.T_map_scan_predicted, *done.reference);
    }
  }
  VANTAGE_TRY(DirectoryEntry entry, localizer.regions().entry(done.report.region));
  done.region = std::move(entry.region.label);
  done.map = entry.summary;
  done.wide_area_points = localizer.regions().summary().map_points;
  done.alert_limit = alert_limit_of(localizer);
  return done;
}
}  // namespace

void add_damage(RunInputs& inputs, const std::optional<Error>& damage) {
  if (!damage) return;
  const auto is_it = [&](const Error& known) {
    return known.message == damage->message && known.where == damage->where;
  };
  if (std::ranges::none_of(inputs.damaged, is_it)) inputs.damaged.push_back(*damage);
}

std::vector<Error> damaged_besides_scans(const RunInputs& inputs) {
  const std::filesystem::path& scans = inputs.scans.path;
  std::vector<Error> others;
  for (const Error& error : inputs.damaged) {
    const std::filesystem::path file = error.where ? error.where->file : std::string();
    // A bag in parts is a folder.
    if (file != scans && file.parent_path() != scans) others.push_back(error);
  }
  return others;
}

void predict(RunScan& scan, const PredictedErrors& of_bundle) {
  if (!scan.report.has_pose) return;
  const Pose& at = scan.reference ? *scan.reference : scan.report.T_map_scan;
  scan.predicted = of_bundle.at(scan.report.region, at.translation);
}

double Odometer::operator()(const RunScan& scan) {
  std::optional<Eigen::Vector3d> at;
  if (scan.reference) {
    at = scan.reference->translation;
    if (!referenced_) last_.reset();  // from the poses to the reference is no way
    referenced_ = true;
  } else if (!referenced_ && scan.report.has_pose) {
    at = scan.report.T_map_scan.translation;
  }
  if (last_ && at) sum_ += (*at - *last_).norm();
  if (at) last_ = at;
  return sum_;
}

std::vector<double> distances(const Run& run) {
  Odometer odometer;
  std::vector<double> way;
  for (const RunScan& scan : run.scans) way.push_back(odometer(scan));
  return way;
}

Result<Run> localize_scans(const Config& config, const PluginLoader& loader,
                           const RunInputs& inputs, const ScanProgress& progress) {
  VANTAGE_TRY(auto localizer, Localizer::open(config, loader));
  return localize_scans(std::move(localizer), config.file, inputs, progress);
}

Result<Run> localize_scans(Localizer localizer, const std::string& config, const RunInputs& inputs,
                           const ScanProgress& progress) {
  std::vector<RunScan> scans;
  const auto keep = [&](const io::StampedScan&, RunScan&& scan) -> Result<void> {
    scans.push_back(std::move(scan));
    return {};
  };
  VANTAGE_TRY(RunInfo info, localize_each(std::move(localizer), config, inputs, keep, progress));
  return Run{std::move(info), std::move(scans)};
}

Result<void> check_stamps(const RunInputs& inputs, double first_stamp,
                          const io::ScanDescription& scans) {
  // Headers and log times may run at different rates, so the last stamp of a bag is a guess.
  constexpr double kLate = 60.0, kLonger = 10.0;  // [s]; times as long as the recording
  double last = std::numeric_limits<double>::infinity();
  if (scans.last_stamp) last = *scans.last_stamp;
  if (scans.last_stamp && !scans.topic.empty()) {
    last = first_stamp + kLate + kLonger * (last - first_stamp);
  }
  if (inputs.window.duration) last = first_stamp + *inputs.window.duration;
  const Span span{.first = first_stamp, .last = std::max(first_stamp, last), .is_whole = false};
  return check_overlap(inputs, span, scans.stamp_rule);
}

Result<ScansRead> first_scans(const RunInputs& inputs, std::size_t count, std::size_t later) {
  VANTAGE_TRY(ScanWindow window, ScanWindow::open(inputs));
  ScansRead read;
  while (read.scans.size() < count) {
    auto scan = window.next();  // the first was read to open the window
    if (!scan) read.damage = std::move(scan).error();
    if (read.damage || !*scan) break;
    read.scans.push_back(**std::move(scan));
  }
  const double first = window.first_stamp();
  const double length =
      std::min(window.describe().last_stamp.value_or(first), window.end()) - first;
  for (std::size_t k = 1; k <= later && !read.damage && read.scans.size() == count; ++k) {
    const double share = static_cast<double>(k) / static_cast<double>(later + 1);
    if (!window.seek(first + share * length)) break;
    auto scan = window.next();
    if (!scan || !*scan) break;  // damage is told when that part is used
    read.later.push_back(**std::move(scan));
  }
  return read;
}

Result<RunInfo> localize_each(Localizer localizer, const std::string& config,
                              const RunInputs& inputs, const ScanSink& sink,
                              const ScanProgress& progress) {
  VANTAGE_TRY(ScanWindow scans, ScanWindow::open(inputs));
  VANTAGE_CHECK(check_stamps(inputs, scans.first_stamp(), scans.describe()));
  VANTAGE_CHECK(start(localizer, inputs, scans));
  RunInfo run{.config = config,
              .stamp_rule = scans.stamp_rule(),
              .map_points = localizer.regions().summary().map_points,
              .regions = localizer.regions().summary().regions,
              .alert_limit = alert_limit_of(localizer),
              .speed = inputs.speed};
  if (inputs.priors) run.prior = {.source = inputs.priors->source, .notes = inputs.priors->notes};
  if (progress) progress(0, scans.expected());
  MotionFeed motion(inputs);
  const Replay replay(inputs.speed, scans.first_stamp());
  double last_stamp = scans.first_stamp();
  std::size_t count = 0;
  while (true) {
    auto next = scans.next();
    if (!next && count > 0) {
      run.failure = std::move(next).error();
      break;
    }
    VANTAGE_TRY(const auto scan, std::move(next));
    if (!scan) break;
    run.seconds_late = std::max(run.seconds_late, replay.wait_for(scan->stamp));
    const auto prior = inputs.priors ? io::prior_at(*inputs.priors, scan->stamp) : std::nullopt;
    auto localized = localize_scan(localizer, inputs, motion, *scan, prior);
    if (!localized && count > 0) {
      run.failure = std::move(localized).error();
      break;
    }
    VANTAGE_TRY(RunScan done, std::move(localized));
    if (prior) ++run.prior->scans;
    if (!scan->seconds.empty()) ++run.timed;
    VANTAGE_CHECK(sink(*scan, std::move(done)));
    last_stamp = scan->stamp;
    ++count;
    if (progress) progress(count, scans.expected());
  }
  if (!run.failure) {
    const Span span{scans.first_stamp(), last_stamp};
    VANTAGE_CHECK(check_overlap(inputs, span, scans.stamp_rule()));
    if (run.prior && run.prior->scans == 0) {  // they lie too far apart
      return fail(lacking(recorded_in(inputs).front(), span, scans.stamp_rule()));
    }
  }
  run.skipped = scans.skipped();
  return run;
}

}  // namespace vantage
