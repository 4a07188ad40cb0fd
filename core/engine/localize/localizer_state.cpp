#include "localize/localizer_state.hpp"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <utility>

#include "vantage/kit/stopwatch.hpp"

namespace vantage {
namespace {

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

}  // namespace

Localizer::State::State(Bundle the_bundle, PluginPtr<ScanMatcher> the_matcher,
                        BundleRelocalizer the_relocalizer, const LocalizerParams& the_params)
    : bundle(std::move(the_bundle)),
      matcher(std::move(the_matcher)),
      relocalizer(std::move(the_relocalizer)),
      params(the_params),
      ahead(directory),
      maps(bundle.reader(), matcher,
           {.memory =
                static_cast<std::size_t>(std::min(params.map_memory * 1024.0 * 1024.0, 0x1p62)),
            .background = params.prefetch}),
      inputs({.T_sensor_imu = pose_of(params.T_sensor_imu),
              .T_sensor_body = pose_of(params.T_sensor_body)}),
      noise(noise_of(params.motion)),
      weighing(*matcher, AlertLimit::of(params)) {}

MotionFilter Localizer::State::unplaced(double now) const {
  const double before = middle.value_or(now);
  Pose upright;
  if (const auto up = inputs.up(before)) {
    upright.rotation = Eigen::Quaterniond::FromTwoVectors(*up, Eigen::Vector3d::UnitZ());
  }
  MotionFilter motion(before, upright, uncertainty(kStartMetres, kStartRadians), inputs);
  motion.predict(now, inputs, noise);
  return motion;
}

std::optional<Eigen::Vector3d> Localizer::State::up(double now) const {
  const auto measured = inputs.up(now);
  return measured || params.gravity == Gravity::unknown ? measured : up_at_start;
}

void Localizer::State::predict(double stamp_of_scan, double now) {
  for (Hypothesis& one : hypotheses) {
    if (!one.motion) {
      one.motion.emplace(stamp_of_scan, *one.initial, uncertainty(kStartMetres, kStartRadians),
                         inputs);
    }
    one.motion->predict(now, inputs, noise);
    one.shown.reset();
    one.alignment.reset();
    one.evidence.reset();
    one.contrast.reset();
    one.failure.clear();
  }
}

Result<Sweep> Localizer::State::sweep_of(const Scan& scan, const SweepTime& time,
                                         const MotionFilter& motion) const {
  Sweep sweep{.time = time, .prepared = {}, .motion = {}};
  if (params.undistort && !scan.seconds.empty()) {
    sweep.motion.emplace(motion.state(), inputs, time, motion.measured());
  }
  VANTAGE_TRY(sweep.prepared, prepare_scan(scan, sweep.motion ? &*sweep.motion : nullptr, params));
  return sweep;
}

Result<void> Localizer::State::use(RegionId next, ScanReport& report) {
  if (!map || next != region) {
    const Stopwatch stopwatch;
    const auto during = [&](Error error) {
      return std::move(error).during("switching to region " + ahead.name_of(next));
    };
    VANTAGE_TRY(RegionMaps::Taken taken, maps.take(next).map_error(during));
    map = std::move(taken.region);
    region = next;
    report.blocked = taken.blocked;
    report.seconds_stall = stopwatch.seconds();
    report.seconds_load = map->seconds_load;
    report.seconds_prepare = map->seconds_prepare;
  }
  report.region = region;
  report.map_points = map->map_points;
  return {};
}

Result<void> Localizer::State::expect_what_is_ahead() {
  if (!params.prefetch) return {};
  const MotionFilter& motion = *hypotheses.front().motion;
  VANTAGE_TRY(auto regions, ahead(motion.pose().translation.head<2>(), motion.velocity().head<2>(),
                                  params.prefetch_time, params.prefetch_distance));
  maps.expect(std::move(regions));
  return {};
}

Result<void> Localizer::State::match(Sweep& sweep, ScanReport& report) {
  const std::size_t followed = hypotheses.size();
  const Sweep predicted = followed > 1 ? sweep : Sweep();
  for (std::size_t h = 0; h < followed; ++h) {
    Hypothesis& one = hypotheses[h];
    // Eq. 11 uses the last estimate; before the first scan, that is the initial pose.
    const auto in_use = h > 0 ? std::optional(one.region)
                        : map ? std::optional(region)
                              : std::nullopt;
    VANTAGE_TRY(const auto choice,
                ahead.choose(in_use, one.last.translation, params.switch_margin));
    one.region = choice.region;
    const auto held = std::exchange(one.map, nullptr);  // until it is borrowed again
    if (h == 0) report.outside = choice.outside;
    const Result<void> used = h == 0 ? use(choice.region, report) : Result<void>();
    auto borrowed = used ? maps.borrow(choice.region) : fail(used.error());
    if (!borrowed) {
      // The next regions have maps again, maybe.
      one.failure = "the map of region " + ahead.name_of(choice.region) +
                    " cannot be used: " + to_string(borrowed.error());
      continue;
    }
    one.map = *std::move(borrowed);
    Sweep of_rival = h == 0 ? Sweep() : predicted;
    Sweep& own = h == 0 ? sweep : of_rival;
    const ScopeTimer timer(report.seconds_align);
    VANTAGE_TRY(SweepMatch match, match_sweep(*one.map->target, *one.motion, inputs, params, own));
    one.shown = match.motion;
    one.alignment = std::move(match.alignment);
    one.R = match.R;
    one.failure = std::move(match.failure);
    if (h == 0) report.passes = match.passes;
    follow_rivals(h, std::move(match.rivals), report.scan_points);
  }
  return {};
}

void Localizer::State::follow_rivals(std::size_t h, std::vector<Alignment> rivals,
                                     std::size_t points) {
  for (Alignment& alignment : rivals) {
    if (follows(alignment.T_map_scan)) continue;
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

Result<Localizer::State::Told> Localizer::State::weigh(const PreparedScan& prepared,
                                                       const std::optional<PosePrior>& prior,
                                                       ScanReport& report) {
  Told told{.contradicted = recovery.is_contradicted(hypotheses, prior)};
  for (Hypothesis& one : hypotheses) see(prior, one);
  const Hypothesis& first = hypotheses.front();
  const bool surprise = weighing.is_surprising(first);
  double doubted = doubt_of_prediction(first);
  // A find is compared with what is followed: both have to be weighed with the same scan.
  told.weighed = recovery.under_way() || told.contradicted || !recovery.is_sure(hypotheses) ||
                 weighing.is_due(hypotheses, first.belief - doubted);
  if (told.weighed) {
    const ScopeTimer timer(report.seconds_verdict);
    VANTAGE_CHECK(weighing.measure(prepared, hypotheses));
    // A scan that does not fit speaks for itself. One that fits again, or after a surprise, may be
    // from a place alike.
    if (first.fits() && surprise) {
      doubted = kDoubt;  // the sensor was carried away, maybe
      for (Hypothesis& one : hypotheses) one.support.start_anew();
    }
    if (first.fits() && weighing.was_adrift()) doubted = std::max(doubted, kDoubt - elsewhere);
  }
  doubt(hypotheses, doubted);
  if (told.weighed) weighing.take(hypotheses);
  elsewhere = update_beliefs(hypotheses);
  // Once the sensor is lost or was carried away, what was compared has become worthless.
  if (surprise || elsewhere > 0.5) recovery.lose(surprise);
  return told;
}

Result<void> Localizer::State::use_best(ScanReport& report) {
  report.region = hypotheses.front().region;
  if (!hypotheses.front().map) {  // it cannot be used
    report.map_points = 0;
    return {};
  }
  // Waiting for a map that could not be expected is not a stall of tracking.
  const bool blocked = report.blocked;
  const double seconds_stall = report.seconds_stall;
  VANTAGE_CHECK(use(hypotheses.front().region, report));
  report.blocked = blocked;
  report.seconds_stall = seconds_stall;
  return {};
}

void Localizer::State::see(const std::optional<PosePrior>& prior, Hypothesis& one) const {
  const double by_prior = prior ? agreement(one.pose(), *prior, recovery.prior_searched()) : 0.0;
  one.support.see_prior(by_prior + agreement(one.pose(), up(one.motion->stamp())));
}

bool Localizer::State::follows(const Pose& T_map_scan) const {
  return std::ranges::any_of(hypotheses, [&](const Hypothesis& followed) {
    return is_same_pose(followed.pose(), T_map_scan);
  });
}

Pose Localizer::State::step(const MotionFilter& expected) const {
  if (hypotheses.empty()) return unplaced(*middle).pose().inverse() * expected.pose();
  const Hypothesis& first = hypotheses.front();
  if (first.initial) return {};
  return first.last.inverse() * (first.fits() ? first.pose() : first.predicted());
}

void Localizer::State::begin_search(const Scan& scan, const PreparedScan& prepared, bool weighed) {
  const auto predicted =
      hypotheses.empty() ? std::nullopt : std::optional(hypotheses.front().predicted());
  const auto area = recovery.area(scan.prior, predicted, directory->summary().map_bounds);
  if (!area) return;
  SearchTask task{.scan = {},
                  .to_itself = weighed ? weighing.fresh_reference() : std::nullopt,
                  .area = *area,
                  .up = inputs.up(*middle)};
  task.scan.points = prepared.points;
  if (!task.to_itself) task.scan.finite = prepared.finite;
  recovery.begin(scan.stamp, std::move(task));
}

Result<void> Localizer::State::take_finds(const Scan& scan, const Sweep& sweep,
                                          const MotionFilter& expected) {
  const PreparedScan& prepared = sweep.prepared;
  auto known = recovery.answer(scan.stamp);
  if (!known) return {};
  if (!known->answer) {
    search_failure = "the search failed: " + to_string(known->answer.error());
    return {};
  }
  SearchAnswer answer = *std::move(known->answer);
  search_failure = answer.failure;
  if (known->T_then_now) {
    VANTAGE_TRY(answer, align_again(std::move(answer), *known->T_then_now, prepared));
  }
  const double missed = recovery.learn(answer, scan.prior.has_value());
  for (Hypothesis& one : hypotheses) learn(answer, missed, one);
  for (const Find& find : answer.finds) {
    VANTAGE_TRY(auto found, hypothesis_at(find, sweep, expected));
    if (!found) continue;
    found->support = Support(std::log(kRecall), answer.around(found->pose()));
    found->support.be_found(missed);
    see(scan.prior, *found);
    VANTAGE_CHECK(weighing.measure(prepared, answer.to_itself, *found));
    weighing.take(*found, 1.0);
    hypotheses.push_back(*std::move(found));
  }
  return {};
}

void Localizer::State::learn(const SearchAnswer& answer, double missed, Hypothesis& one) const {
  if (answer.tried.empty()) return;
  one.support.be_among(answer.around(one.pose()).scale);
  const bool is_found = std::ranges::any_of(answer.finds, [&](const Find& find) {
    return is_same_pose(find.alignment.T_map_scan, one.pose());
  });
  if (is_found) one.support.be_found(missed);
}

Result<std::optional<Hypothesis>> Localizer::State::hypothesis_at(
    const Find& find, const Sweep& sweep, const MotionFilter& expected) const {
  constexpr double kMatched = 1.0, kTurned = 5.0 * std::numbers::pi / 180.0;  // [m], [rad]
  using Outcome = Result<std::optional<Hypothesis>>;
  const Pose& pose = find.alignment.T_map_scan;
  if (follows(pose)) return Outcome();
  // The sensor was elsewhere all the time: its motion continues from there.
  MotionFilter motion = expected;
  motion.place(pose, uncertainty(kSameMetres, kSameRadians));
  Sweep own = sweep;
  VANTAGE_TRY(SweepMatch match, match_sweep(*find.map->target, motion, inputs, params, own));
  if (!match.alignment) return Outcome();
  const Pose& matched = match.alignment->T_map_scan;
  if (!is_near(matched, pose, kMatched, kTurned) || follows(matched)) return Outcome();
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

void Localizer::State::move_on(const MotionFilter& best) {
  for (std::size_t h = 0; h < hypotheses.size(); ++h) {
    Hypothesis& one = hypotheses[h];
    one.motion = h == 0 ? best : one.moved();
    one.last = one.motion->pose();
    one.initial.reset();
    one.is_new = false;
  }
  inputs.forget_before(*middle);
}

void Localizer::State::forget_everything(bool lost) {
  hypotheses.clear();
  map.reset();
  elsewhere = 1.0;
  up_at_start = Eigen::Vector3d::UnitZ();
  stamp.reset();
  middle.reset();
  since.reset();
  inputs.forget();  // the clock may be another one
  recovery.forget();
  search_failure.clear();
  weighing.forget();
  was_lost = lost;
  started = true;
}

}  // namespace vantage
