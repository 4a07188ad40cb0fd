#include "vantage/engine/localizer.hpp"

#include <algorithm>
#include <bit>
#include <cmath>
#include <functional>
#include <numbers>
#include <optional>
#include <utility>
#include <vector>

#include "bundle/built_as_asked.hpp"
#include "localize/hypothesis.hpp"
#include "localize/search_area.hpp"
#include "localize/search_job.hpp"
#include "localize/searcher.hpp"
#include "localize/sweep_matching.hpp"
#include "localize/verdict.hpp"
#include "localize/weighing.hpp"
#include "vantage/engine/region_maps.hpp"
#include "vantage/engine/regions_ahead.hpp"
#include "vantage/kit/stopwatch.hpp"

namespace vantage {

const char* to_string(Tracking tracking) noexcept {
  switch (tracking) {
    case Tracking::tracked: return "tracked";
    case Tracking::uncertain: return "uncertain";
    case Tracking::lost: return "lost";
  }
  return "unknown";
}

namespace {

// With less belief than this in the best hypothesis, others are looked for.
constexpr double kSure = 0.8;
// Standard deviations of a pose that a user gives [m], [rad].
constexpr double kStartMetres = 1.0, kStartRadians = 0.1;

PoseMatrix uncertainty(double metres, double radians) {
  PoseVector variance;
  variance << Eigen::Vector3d::Constant(metres * metres),
      Eigen::Vector3d::Constant(radians * radians);
  return variance.asDiagonal();
}

/// A pose of a file: x, y, z, roll, pitch, yaw.
Pose pose_of(const std::vector<double>& x) {
  return pose_from_xyz_rpy({x[0], x[1], x[2]}, {x[3], x[4], x[5]});
}

MotionNoise noise_of(MotionModel model) {
  MotionNoise noise;
  if (model == MotionModel::planar) noise.upright = 0.1;
  return noise;
}
/// Errors: `invalid_input` for a pose that is not rigid, or a deviation that is not positive.
Result<void> check_prior(const PosePrior& prior) {
  if (!is_valid(prior.T_map_sensor) || !is_on_earth(prior.T_map_sensor)) {
    return fail(ErrorCode::invalid_input,
                "the prior of the scan is not a rigid transform, or is farther away than 1e8 m");
  }
  for (const double sigma : {prior.sigma_translation.x(), prior.sigma_translation.y(),
                             prior.sigma_translation.z(), prior.sigma_heading}) {
    if (sigma > 0.0) continue;  // infinite: nothing is known
    return fail(ErrorCode::invalid_input, "a standard deviation of the scan's prior is " +
                                              std::to_string(sigma) +
                                              ", expected a positive number");
  }
  return {};
}

}  // namespace

struct Localizer::State {
  State(Bundle the_bundle, PluginPtr<ScanMatcher> the_matcher, BundleRelocalizer the_relocalizer,
        const LocalizerParams& the_params, const ShareModel& model)
      : bundle(std::move(the_bundle)),
        matcher(std::move(the_matcher)),
        relocalizer(std::move(the_relocalizer)),
        params(the_params),
        ahead(directory),
        maps(bundle.store(), matcher,
             {.memory = static_cast<std::size_t>(params.map_memory * 1024.0 * 1024.0),
              .background = params.prefetch}),
        inputs({.T_sensor_imu = pose_of(params.T_sensor_imu),
                .T_sensor_body = pose_of(params.T_sensor_body)}),
        noise(noise_of(params.motion)),
        weighing(*matcher, model, AlertLimit::of(params)) {}

  Bundle bundle;
  PluginPtr<ScanMatcher> matcher;
  BundleRelocalizer relocalizer;
  std::shared_ptr<const RegionDirectory> directory = bundle.directory();
  LocalizerParams params;
  RegionsAhead ahead;
  RegionMaps maps;  // uses bundle and matcher

  MotionInputs inputs;
  MotionNoise noise;

  bool started = false;
  std::optional<double> stamp;         // of the last scan
  std::optional<double> middle;        // of its sweep [s]
  std::vector<Hypothesis> hypotheses;  // the first is the one that is reported
  double elsewhere = 1.0;              // the belief that the sensor is at none of them

  std::optional<MotionFilter> since;  // the last scan, if it was tracked; up to the last question

  std::shared_ptr<const ReadyRegion> map;  // of `region`
  RegionId region;

  Weighing weighing;
  Verdict verdict{params};
  bool compared = false;                 // the hypotheses with all other places
  std::uint32_t doubtful_scans = 0;      // in a row
  std::uint32_t contradicted_scans = 0;  // by their priors, in a row
  bool prior_searched = false;           // the place where these priors say that the sensor is

  Searcher searcher{bundle, relocalizer, matcher, ahead, maps, params};
  double failed_searches = 0.0;  // of all places, until a scan was tracked; by their news
  double way = kBasin;           // since the last one [m]
  bool startled = false;         // the sensor was carried away, maybe, since the search began
  bool surprised = false;        // by a scan, since a search began last
  SearchJob job{std::ref(searcher), {params.live, params.search_budget}};  // last: may be running

  [[nodiscard]] Result<RegionsAhead::Choice> choose_region(const Point& position) const {
    return ahead.choose(map ? std::optional(region) : std::nullopt, position, params.switch_margin);
  }

  /// The motion until the middle of a sweep, of a sensor that may be anywhere. Nothing is known of
  /// its speed, so it begins at rest, unless odometry says more.
  [[nodiscard]] MotionFilter unplaced(double now) const {
    const double before = middle.value_or(now);
    Pose upright;
    if (const auto up = inputs.up(before)) {
      upright.rotation = Eigen::Quaterniond::FromTwoVectors(*up, Eigen::Vector3d::UnitZ());
    }
    MotionFilter motion(before, upright, uncertainty(kStartMetres, kStartRadians), inputs);
    motion.predict(now, inputs, noise);
    return motion;
  }

  /// Predicts every hypothesis at the middle of a sweep.
  /// @param stamp_of_scan  where a sensor begins that was started [s]
  void predict(double stamp_of_scan, double now) {
    for (Hypothesis& one : hypotheses) {
      one.before = one.motion;
      if (!one.motion) {
        one.motion.emplace(stamp_of_scan, *one.initial, uncertainty(kStartMetres, kStartRadians),
                           inputs);
      }
      one.motion->predict(now, inputs, noise);
      one.has_odometry = inputs.has_odometry(now);
      one.shown.reset();
      one.alignment.reset();
      one.evidence.reset();
      one.contrast.reset();
      one.failure.clear();
    }
  }

  /// The motion that a scan is undistorted by before it is matched.
  [[nodiscard]] Result<Sweep> sweep_of(const Scan& scan, const SweepTime& time,
                                       const MotionFilter& motion) const {
    Sweep sweep{.time = time, .prepared = {}, .motion = {}};
    if (params.undistort && !scan.seconds.empty()) {
      sweep.motion.emplace(motion.state(), inputs, time, motion.measured());
    }
    VANTAGE_TRY(sweep.prepared,
                prepare_scan(scan, sweep.motion ? &*sweep.motion : nullptr, params));
    return sweep;
  }

  /// Makes a region's map the one that scans are matched against.
  Result<void> use(RegionId next, ScanReport& report) {
    if (!map || next != region) {
      const Stopwatch stopwatch;
      auto taken = maps.take(next);
      if (!taken) {
        return fail(std::move(taken).error().during("switching to region " + ahead.name_of(next)));
      }
      map = std::move(taken->region);
      region = next;
      report.blocked = taken->blocked;
      report.seconds_stall = stopwatch.seconds();
      report.seconds_load = map->seconds_load;
      report.seconds_prepare = map->seconds_prepare;
    }
    report.region = region;
    report.map_points = map->map_points;
    return {};
  }

  Result<void> expect_what_is_ahead() {
    if (!params.prefetch) return {};
    const MotionFilter& motion = *hypotheses.front().motion;
    VANTAGE_TRY(auto regions,
                ahead(motion.pose().translation.head<2>(), motion.velocity().head<2>(),
                      params.prefetch_time, params.prefetch_distance));
    maps.expect(std::move(regions));
    return {};
  }

  /// Matches a sweep at each hypothesis's prediction. The points become those of the first. Where
  /// the sweep fits at another place around a prediction, too, that becomes a hypothesis.
  Result<void> match(Sweep& sweep, ScanReport& report) {
    const std::size_t followed = hypotheses.size();
    const Sweep predicted = followed > 1 ? sweep : Sweep();
    for (std::size_t h = 0; h < followed; ++h) {
      Hypothesis& one = hypotheses[h];
      // Eq. 11 uses the last estimate; before the first scan, that is the initial pose.
      VANTAGE_TRY(const auto choice, choose_region(one.last.translation));
      std::shared_ptr<const ReadyRegion> ready;
      if (h == 0) {
        report.outside = choice.outside;
        VANTAGE_CHECK(use(choice.region, report));
        ready = map;
      } else {
        VANTAGE_TRY(ready, maps.borrow(choice.region));
      }
      one.map = ready;
      one.region = choice.region;
      Sweep own = h == 0 ? std::move(sweep) : predicted;
      const Stopwatch stopwatch;
      VANTAGE_TRY(SweepMatch match,
                  match_sweep(*one.map->target, *one.motion, inputs, params, own));
      one.shown = match.motion;
      one.alignment = std::move(match.alignment);
      one.R = match.R;
      one.failure = std::move(match.failure);
      if (h == 0) {
        report.seconds_align = stopwatch.seconds();
        report.passes = match.passes;
        sweep = std::move(own);
      }
      follow_rivals(h, std::move(match.rivals), report.scan_points);
    }
    return {};
  }

  /// @param h       the hypothesis around whose prediction they are
  /// @param points  that were aligned
  void follow_rivals(std::size_t h, std::vector<Alignment> rivals, std::size_t points) {
    for (Alignment& alignment : rivals) {
      const bool known = std::ranges::any_of(hypotheses, [&](const Hypothesis& other) {
        return is_same_pose(other.pose(), alignment.T_map_scan);
      });
      if (known) continue;
      if (hypotheses.size() >= 2 * params.max_hypotheses) return;
      Hypothesis rival = hypotheses[h];
      rival.is_new = true;
      rival.R = vantage::noise_of(alignment, points, params);
      rival.alignment = std::move(alignment);
      rival.shown.reset();
      // Both are that far from one prediction, whose odds they share.
      const double odds = std::exp(0.5 * (hypotheses[h].innovation() - rival.innovation()));
      hypotheses[h].support.favour(-std::log1p(odds));
      rival.support.favour(-std::log1p(1.0 / odds));
      hypotheses.push_back(std::move(rival));
    }
  }

  /// Makes the map of the best hypothesis the current one.
  Result<void> use_best(ScanReport& report) {
    if (map && hypotheses.front().region == region) return {};
    // Waiting for a map that could not be expected is not a stall of tracking.
    const bool blocked = report.blocked;
    const double seconds_stall = report.seconds_stall;
    VANTAGE_CHECK(use(hypotheses.front().region, report));
    report.blocked = blocked;
    report.seconds_stall = seconds_stall;
    return {};
  }

  /// Whether no other poses need to be looked for.
  [[nodiscard]] bool is_sure() const {
    return !hypotheses.empty() && compared && hypotheses.front().fits() &&
           hypotheses.front().belief >= kSure;
  }

  /// Whether to look where a prior says that the sensor is, although there is no other doubt: less
  /// and less often while priors contradict the scans.
  [[nodiscard]] bool is_contradicted(const std::optional<PosePrior>& prior) {
    if (!prior || hypotheses.empty()) return false;
    const bool agrees = agreement(hypotheses.front().pose(), *prior, false) >= 0.0;
    contradicted_scans = agrees ? 0 : contradicted_scans + 1;
    prior_searched = prior_searched && !agrees;
    return std::has_single_bit(contradicted_scans);
  }

  /// Tells each hypothesis what a prior says of it. A scan without one says nothing.
  void see(const std::optional<PosePrior>& prior) {
    for (Hypothesis& one : hypotheses) {
      one.support.see_prior(prior ? agreement(one.pose(), *prior, prior_searched) : 0.0);
    }
  }

  /// How the sensor moved since the scan before. @param expected  the motion without this scan
  [[nodiscard]] Pose step(const MotionFilter& expected) const {
    if (hypotheses.empty()) return unplaced(*middle).pose().inverse() * expected.pose();
    const Hypothesis& first = hypotheses.front();
    if (first.initial) return {};
    return first.last.inverse() * (first.fits() ? first.pose() : first.predicted());
  }

  /// @param weighed  whether the scan was
  void begin_search(const Scan& scan, const PreparedScan& prepared, bool weighed) {
    const auto predicted =
        hypotheses.empty() ? std::nullopt : std::optional(hypotheses.front().predicted());
    const auto area = search_area(scan.prior, predicted, directory->summary().map_bounds,
                                  doubtful_scans, surprised, params);
    if (!area) return;
    startled = surprised = false;
    job.begin(scan.stamp, {prepared, weighed ? weighing.fresh_reference() : std::nullopt, *area,
                           inputs.up(*middle)});
  }

  /// Adds what the search under way found to the hypotheses, once it is known.
  /// @param expected  the sensor's motion without this scan
  Result<void> take_finds(const Scan& scan, const Sweep& sweep, const MotionFilter& expected) {
    const PreparedScan& prepared = sweep.prepared;
    auto known = job.answer(scan.stamp);
    if (!known) return {};
    VANTAGE_TRY(SearchAnswer answer, std::move(known->answer));
    if (!answer.searchable) params.recovery_radius = 0.0;
    if (known->T_then_now) {
      VANTAGE_TRY(answer.found.finds,
                  align_again(answer.found.finds, *known->T_then_now, prepared.points,
                              Weighing::scored(prepared), answer.to_itself));
      for (Tried& one : answer.found.tried) one.T_map_scan = one.T_map_scan * *known->T_then_now;
    }
    compared = compared || !answer.searchable || (answer.compared && !startled);
    prior_searched = prior_searched || contradicted_scans > 0;
    const double missed = missed_by_search(scan.prior ? 0.0 : failed_searches);
    for (Hypothesis& one : hypotheses) learn(answer, missed, one);
    for (const Find& find : answer.found.finds) {
      VANTAGE_TRY(auto found, hypothesis_at(find, sweep, expected));
      if (!found) continue;
      found->support =
          Support(std::log(kRecall), answer.found.around(found->pose(), weighing.model()));
      found->support.be_found(missed);
      if (scan.prior) {
        found->support.see_prior(agreement(found->pose(), *scan.prior, prior_searched));
      }
      VANTAGE_CHECK(weighing.measure(prepared, answer.to_itself, *found));
      weighing.take_first(*found);
      hypotheses.push_back(*std::move(found));
    }
    if (answer.compared && !scan.prior) {
      failed_searches += std::min(1.0, way / kBasin);
      way = 0.0;
    }
    return {};
  }

  /// Tells a hypothesis how well wrong poses fit around here, and whether the search found it.
  void learn(const SearchAnswer& answer, double missed, Hypothesis& one) const {
    if (answer.found.tried.empty()) return;
    one.support.be_among(answer.found.around(one.pose(), weighing.model()).scale);
    const bool is_found = std::ranges::any_of(answer.found.finds, [&](const Find& find) {
      return is_same_pose(find.alignment.T_map_scan, one.pose());
    });
    if (is_found) one.support.be_found(missed);
  }

  /// @return nothing if nothing matches there, or if that pose is followed already
  [[nodiscard]] Result<std::optional<Hypothesis>> hypothesis_at(
      const Find& find, const Sweep& sweep, const MotionFilter& expected) const {
    constexpr double kMatched = 1.0, kTurned = 5.0 * std::numbers::pi / 180.0;  // [m], [rad]
    using Outcome = Result<std::optional<Hypothesis>>;
    const auto is_known = [&](const Pose& pose) {
      return std::ranges::any_of(
          hypotheses, [&](const Hypothesis& known) { return is_same_pose(known.pose(), pose); });
    };
    const Pose& pose = find.alignment.T_map_scan;
    if (is_known(pose)) return Outcome();
    // The sensor was elsewhere all the time: its motion continues from there.
    MotionFilter motion = expected;
    motion.place(pose, uncertainty(kSameMetres, kSameRadians));
    Sweep own = sweep;
    VANTAGE_TRY(SweepMatch match, match_sweep(*find.map->target, motion, inputs, params, own));
    if (!match.alignment) return Outcome();
    const Pose& matched = match.alignment->T_map_scan;
    if (!is_near(matched, pose, kMatched, kTurned) || is_known(matched)) return Outcome();
    Hypothesis found{.initial = pose,
                     .last = pose,
                     .motion = motion,
                     .shown = match.motion,
                     .region = find.region,
                     .map = find.map,
                     .alignment = std::move(match.alignment),
                     .R = match.R};
    return Outcome(std::move(found));
  }

  /// Every hypothesis takes the scan in. @param best  the motion of the one that is reported
  void move_on(const MotionFilter& best) {
    for (std::size_t h = 0; h < hypotheses.size(); ++h) {
      Hypothesis& one = hypotheses[h];
      one.motion = h == 0 ? best : one.moved();
      one.last = one.motion->pose();
      one.initial.reset();
      one.is_new = false;
    }
    inputs.forget_before(*middle);
  }

  void forget_everything(bool lost) {
    hypotheses.clear();
    elsewhere = 1.0;
    job.drop();
    stamp.reset();
    middle.reset();
    since.reset();
    inputs = MotionInputs(inputs.mounts());    // the clock may be another one
    compared = params.recovery_radius == 0.0;  // nothing to compare with
    startled = surprised = false;
    doubtful_scans = contradicted_scans = 0;
    failed_searches = 0.0;
    way = kBasin;
    prior_searched = false;
    weighing.forget();
    verdict.forget(lost);
    started = true;
  }
};

Localizer::Localizer(std::unique_ptr<State> state) : state_(std::move(state)) {}
Localizer::Localizer(Localizer&&) noexcept = default;
Localizer& Localizer::operator=(Localizer&&) noexcept = default;
Localizer::~Localizer() = default;

Result<Localizer> Localizer::open(Bundle bundle, PluginPtr<ScanMatcher> matcher,
                                  BundleRelocalizer relocalizer, const LocalizerParams& params,
                                  const ShareModel& model) {
  const BundleSummary& all = bundle.directory()->summary();
  if (all.empty_regions == all.regions) {
    return fail(ErrorCode::invalid_input, "no region of the bundle holds any point");
  }
  VANTAGE_CHECK(check_prepared_for(bundle, *matcher));
  // A program may have set what a file could not.
  VANTAGE_TRY(const LocalizerParams checked, parse<LocalizerParams>(to_table(params)));
  return Localizer(std::make_unique<State>(std::move(bundle), std::move(matcher),
                                           std::move(relocalizer), checked, model));
}

const RegionDirectory& Localizer::regions() const noexcept { return *state_->directory; }
const LocalizerParams& Localizer::params() const noexcept { return state_->params; }

Result<void> Localizer::start(const Pose& T_map_scan) {
  State& s = *state_;
  if (!is_valid(T_map_scan) || !is_on_earth(T_map_scan)) {
    return fail(ErrorCode::invalid_input,
                "the initial pose is not a rigid transform, or is farther away than 1e8 m");
  }
  VANTAGE_TRY(const auto choice, s.choose_region(T_map_scan.translation));
  auto taken = s.maps.take(choice.region);  // so that the first scan finds the map ready
  if (!taken) {
    return fail(std::move(taken).error().during("making region " + s.ahead.name_of(choice.region) +
                                                " ready"));
  }
  s.forget_everything(false);
  const double log_odds = std::log((1.0 - kDoubt) / kDoubt);
  s.hypotheses.push_back({.initial = T_map_scan,
                          .last = T_map_scan,
                          .support = Support(log_odds, Lookalikes::of(s.weighing.model()))});
  s.elsewhere = update_beliefs(s.hypotheses);
  return {};
}

void Localizer::start_anywhere() {
  State& s = *state_;
  s.forget_everything(true);
}

Result<ScanReport> Localizer::localize(const Scan& scan) {
  State& s = *state_;
  if (!s.started) {
    return fail(ErrorCode::invalid_input, "localization has no first pose: call start");
  }
  s.since.reset();
  if (scan.prior) VANTAGE_CHECK(check_prior(*scan.prior));
  if (!std::isfinite(scan.stamp) || (s.stamp && scan.stamp <= *s.stamp)) {
    return fail(ErrorCode::invalid_input,
                "scan stamps must increase: " + std::to_string(scan.stamp) + " s" +
                    (s.stamp ? " follows " + std::to_string(*s.stamp) + " s" : ""));
  }
  VANTAGE_TRY(const SweepTime time, time_of(scan));
  ScanReport report;
  report.stamp = scan.stamp;
  const auto during = [&](Error error) {
    return fail(
        std::move(error).during("matching the scan at " + std::to_string(scan.stamp) + " s"));
  };
  // All poses are those at the middle of the sweep, until the end.
  s.predict(scan.stamp, time.middle());
  const MotionFilter expected =
      s.hypotheses.empty() ? s.unplaced(time.middle()) : *s.hypotheses.front().motion;
  VANTAGE_TRY(Sweep sweep, s.sweep_of(scan, time, expected));
  const PreparedScan& prepared = sweep.prepared;
  report.scan_points = prepared.points.size();
  report.dropped_points = prepared.dropped;
  Scan centred = scan;  // what is known at the stamp, at the middle of the sweep
  if (scan.prior) {
    const Pose at_stamp = expected.at(scan.stamp, s.inputs, s.noise).pose();
    Pose& prior = centred.prior->T_map_sensor;
    prior = prior * (at_stamp.inverse() * expected.pose());
  }

  const bool had_map = s.map != nullptr;
  const RegionId region_before = s.region;
  bool weighed = false, surprise = false, contradicted = false;
  if (!s.hypotheses.empty()) {
    VANTAGE_CHECK(s.match(sweep, report));
    contradicted = s.is_contradicted(centred.prior);
    s.see(centred.prior);
    const Hypothesis& first = s.hypotheses.front();
    surprise = s.weighing.is_surprising(first);
    double doubted = doubt_of_prediction(first);
    // A find is compared with what is followed: both have to be weighed with the same scan.
    weighed = s.job.under_way() || contradicted || !s.is_sure() ||
              s.weighing.is_due(s.hypotheses, first.belief - doubted);
    if (weighed) {
      const ScopeTimer timer(report.seconds_verdict);
      if (auto measured = s.weighing.measure(prepared, s.hypotheses); !measured) {
        return during(std::move(measured).error());
      }
      // A scan that does not fit speaks for itself. One that fits again, or after a surprise, may
      // be from a place alike.
      if (first.fits() && surprise) {
        doubted = kDoubt;  // the sensor was carried away, maybe
        for (Hypothesis& one : s.hypotheses) one.support.start_anew();
      }
      if (first.fits() && s.weighing.was_adrift()) {
        doubted = std::max(doubted, kDoubt - s.elsewhere);
      }
      doubt(s.hypotheses, doubted);
      s.weighing.take(s.hypotheses);
    } else {
      doubt(s.hypotheses, doubted);
    }
    s.elsewhere = update_beliefs(s.hypotheses);
  }
  // Once the sensor is lost or was carried away, what was compared has become worthless.
  if (surprise || (!s.hypotheses.empty() && s.elsewhere > 0.5)) {
    s.startled = s.startled || s.compared || surprise;
    s.surprised = s.surprised || surprise;
    s.compared = s.params.recovery_radius == 0.0;
  }
  const bool sure = s.is_sure();
  s.doubtful_scans = sure ? 0 : s.doubtful_scans + 1;
  if (s.middle) {
    const Pose step = s.step(expected);
    s.way += step.translation.norm();
    s.job.move(step);
  }
  s.middle = time.middle();
  const Stopwatch search;
  if ((!sure || contradicted) && !prepared.points.empty() && !s.job.under_way()) {
    s.begin_search(centred, prepared, weighed);
  }
  if (s.job.under_way() && !prepared.points.empty()) {
    if (auto taken = s.take_finds(centred, sweep, expected); !taken) {
      return during(std::move(taken).error());
    }
    report.seconds_search = search.seconds();
  }
  if (weighed || s.hypotheses.size() > 1) s.weighing.compare(s.hypotheses);
  s.stamp = scan.stamp;
  if (s.hypotheses.empty()) {
    s.inputs.forget_before(*s.middle);
    report.reason = "the sensor has not been found yet";
    report.has_pose = false;
    return report;
  }
  s.elsewhere = update_beliefs(s.hypotheses);
  s.elsewhere += sort_out(s.hypotheses, s.params.max_hypotheses);
  VANTAGE_CHECK(s.use_best(report));
  report.switched = s.map && (!had_map || s.region != region_before);
  Hypothesis& best = s.hypotheses.front();
  const MotionFilter motion =
      s.verdict.conclude(s.hypotheses,
                         {.elsewhere = s.elsewhere,
                          .compared = s.compared,
                          .scores_as_usual = s.weighing.scores_as_usual(best)},
                         s.inputs, s.noise, report);
  const auto at_stamp = [&](const MotionFilter& at_middle) {
    return best.before ? pose_between(*best.before, at_middle, scan.stamp, s.inputs, s.noise)
                       : at_middle.at(scan.stamp, s.inputs, s.noise).pose();
  };
  report.T_map_scan = at_stamp(motion);
  report.T_map_scan_predicted = at_stamp(*best.motion);
  const bool tracked = report.tracking == Tracking::tracked;
  s.weighing.learn(best, tracked);
  if (tracked) s.failed_searches = 0.0;
  report.held_bytes = s.maps.statistics().bytes;
  report.dropped_samples = s.inputs.dropped();
  s.move_on(motion);
  if (tracked) s.since = motion;
  VANTAGE_CHECK(s.expect_what_is_ahead());
  return report;
}

std::optional<SensorMotion> Localizer::motion_at(double stamp) {
  State& s = *state_;
  if (!s.since || !(stamp >= s.since->stamp())) return std::nullopt;
  const auto pieces = s.inputs.between(s.since->stamp(), stamp, s.since->measured());
  s.since->predict(stamp, s.inputs, s.noise);
  const MotionState& body = s.since->state();
  const Twist twist = twist_of(body, pieces.empty() ? MotionInput{} : pieces.back());
  const Pose T_sensor_body = s.inputs.T_sensor_body();
  const Eigen::Matrix3d R = T_sensor_body.rotation.toRotationMatrix();
  const Eigen::Vector3d sensor_in_body = T_sensor_body.inverse().translation;
  return SensorMotion{.stamp = stamp,
                      .T_map_sensor = s.since->pose(),
                      .covariance = s.since->pose_covariance(),
                      .twist = {.linear = R * (twist.linear + twist.angular.cross(sensor_in_body)),
                                .angular = R * twist.angular}};
}

Result<void> Localizer::add(const ImuSample& sample) { return state_->inputs.add(sample); }
Result<void> Localizer::add(const OdometrySample& sample) { return state_->inputs.add(sample); }

}  // namespace vantage
