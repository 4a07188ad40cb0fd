#include "vantage/engine/localizer.hpp"

#include <cmath>
#include <optional>
#include <string_view>
#include <utility>

#include "bundle/built_as_asked.hpp"
#include "localize/localizer_state.hpp"
#include "localize/place_index.hpp"
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

constexpr std::string_view kLocalization = "localization";  // what a missing table would be for

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

/// Moves a prior by the motion from one pose to another.
/// @param placed  whether these are poses in the map
void move_on(PosePrior& prior, const Pose& from, const Pose& to, bool placed) {
  if (std::isfinite(prior.sigma_heading)) {
    prior.T_map_sensor = prior.T_map_sensor * (from.inverse() * to);
  } else if (placed) {
    prior.T_map_sensor.translation += to.translation - from.translation;
  } else {  // nothing says in which direction that was
    const double way = (to.translation - from.translation).norm();
    for (const Eigen::Index axis : {0, 1}) {
      prior.sigma_translation[axis] = std::hypot(prior.sigma_translation[axis], way);
    }
  }
}

}  // namespace

Localizer::Localizer(std::unique_ptr<State> state) : state_(std::move(state)) {}
Localizer::Localizer(Localizer&&) noexcept = default;
Localizer& Localizer::operator=(Localizer&&) noexcept = default;
Localizer::~Localizer() = default;

Result<Localizer> Localizer::of(Bundle bundle, PluginPtr<ScanMatcher> matcher,
                                BundleRelocalizer relocalizer, const LocalizerParams& params) {
  const BundleSummary& all = bundle.directory()->summary();
  if (all.empty_regions == all.regions) {
    return fail(ErrorCode::invalid_input, "no region of the bundle holds any point");
  }
  VANTAGE_CHECK(check_prepared_for(bundle, *matcher));
  // A program may have set what a file could not.
  VANTAGE_TRY(const LocalizerParams checked, parse<LocalizerParams>(to_table(params)));
  return Localizer(std::make_unique<State>(std::move(bundle), std::move(matcher),
                                           std::move(relocalizer), checked));
}

Result<Localizer> Localizer::open(Bundle bundle, PluginPtr<ScanMatcher> matcher,
                                  PluginPtr<Relocalizer> relocalizer,
                                  const LocalizerParams& params) {
  return of(std::move(bundle), std::move(matcher),
            BundleRelocalizer{.plugin = std::move(relocalizer)}, params);
}

Result<Localizer> Localizer::open(Bundle bundle, const Config& config,
                                  const PluginLoader& plugins) {
  VANTAGE_TRY(const PluginChoice choice, config.need(config.matcher, "matcher", kLocalization));
  VANTAGE_TRY(auto matcher, plugins.load<ScanMatcher>(choice));
  VANTAGE_TRY(BundleRelocalizer relocalizer, relocalizer_for(bundle, config, plugins));
  return of(std::move(bundle), std::move(matcher), std::move(relocalizer),
            config.localizer.value_or(LocalizerParams{}));
}

Result<Localizer> Localizer::open(const Config& config, const PluginLoader& plugins) {
  VANTAGE_TRY(Bundle bundle, Bundle::open(config, plugins, kLocalization));
  return open(std::move(bundle), config, plugins);
}

const RegionDirectory& Localizer::regions() const noexcept { return *state_->directory; }
const LocalizerParams& Localizer::params() const noexcept { return state_->params; }

Result<void> Localizer::start(const Pose& T_map_scan) {
  State& s = *state_;
  if (!is_valid(T_map_scan) || !is_on_earth(T_map_scan)) {
    return fail(ErrorCode::invalid_input,
                "the initial pose is not a rigid transform, or is farther away than 1e8 m");
  }
  VANTAGE_TRY(const auto choice,
              s.ahead.choose(std::nullopt, T_map_scan.translation, s.params.switch_margin));
  const auto during = [&](Error error) {
    return std::move(error).during("making region " + s.ahead.name_of(choice.region) + " ready");
  };
  // So that the first scan finds the map ready.
  VANTAGE_CHECK(s.maps.take(choice.region).map_error(during));
  s.forget_everything(false);
  s.up_at_start = up_of(T_map_scan);
  const double log_odds = std::log((1.0 - kDoubt) / kDoubt);
  s.hypotheses.push_back({.initial = T_map_scan, .last = T_map_scan, .support = Support(log_odds)});
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
  if (scan.prior) VANTAGE_CHECK(check_prior(*scan.prior));
  if (!std::isfinite(scan.stamp) || (s.stamp && scan.stamp <= *s.stamp)) {
    return fail(ErrorCode::invalid_input,
                "scan stamps must increase: " + std::to_string(scan.stamp) + " s" +
                    (s.stamp ? " follows " + std::to_string(*s.stamp) + " s" : ""));
  }
  VANTAGE_TRY(const SweepTime time, time_of(scan));
  s.since.reset();
  ScanReport report;
  report.stamp = scan.stamp;
  const auto during = [&](Error error) {
    return std::move(error).during("matching the scan at " + std::to_string(scan.stamp) + " s");
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
    move_on(*centred.prior, at_stamp, expected.pose(), !s.hypotheses.empty());
  }

  const bool had_map = s.map != nullptr;
  const RegionId region_before = s.region;
  State::Told told;
  if (!s.hypotheses.empty()) {
    VANTAGE_CHECK(s.match(sweep, report));
    VANTAGE_TRY(told, s.weigh(prepared, centred.prior, report).map_error(during));
  }
  const bool sure = s.recovery.is_sure(s.hypotheses);
  s.recovery.count(sure);
  if (s.middle) s.recovery.move(s.step(expected));
  s.middle = time.middle();
  const Stopwatch search;
  if ((!sure || told.contradicted) && !prepared.points.empty() && !s.recovery.under_way()) {
    s.begin_search(centred, prepared, told.weighed);
  }
  if (s.recovery.under_way() && !prepared.points.empty()) {
    VANTAGE_CHECK(s.take_finds(centred, sweep, expected).map_error(during));
    report.seconds_search = search.seconds();
  }
  report.searching = s.recovery.under_way();
  report.search_failure = s.search_failure;
  s.weighing.compare(s.hypotheses);
  s.stamp = scan.stamp;
  report.dropped_samples = s.inputs.dropped();
  if (s.hypotheses.empty()) {
    report.held_bytes = s.maps.statistics().bytes;
    s.inputs.forget_before(*s.middle);
    report.reason = with_failure("the sensor has not been found yet", report);
    report.has_pose = false;
    return report;
  }
  s.elsewhere = update_beliefs(s.hypotheses);
  s.elsewhere += sort_out(s.hypotheses, s.params.max_hypotheses);
  VANTAGE_CHECK(s.use_best(report));
  report.switched = s.map && (!had_map || s.region != region_before);
  Hypothesis& best = s.hypotheses.front();
  report.seconds_doubted = best.motion->doubted();
  const MotionFilter motion = conclude(s.hypotheses,
                                       {.elsewhere = s.elsewhere,
                                        .compared = s.recovery.compared(),
                                        .scores_as_usual = s.weighing.scores_as_usual(best),
                                        .upright = agreement(best.pose(), s.up(*s.middle)) == 0.0},
                                       s.inputs, s.noise, s.params, report);
  const auto at_stamp = [&](const MotionFilter& at_middle) {
    return at_middle.at(scan.stamp, s.inputs, s.noise).pose();
  };
  report.T_map_scan = at_stamp(motion);
  report.T_map_scan_predicted = at_stamp(*best.motion);
  const bool tracked = report.tracking == Tracking::tracked;
  report.recovered = tracked && s.was_lost;
  s.was_lost = !tracked && (s.was_lost || report.tracking == Tracking::lost);
  s.weighing.learn(best, tracked);
  report.held_bytes = s.maps.statistics().bytes;
  s.move_on(motion);
  if (tracked) {
    s.recovery.succeed();
    s.since = motion;
  }
  VANTAGE_CHECK(s.expect_what_is_ahead());
  return report;
}

std::optional<SensorMotion> Localizer::motion_at(double stamp) {
  State& s = *state_;
  if (!s.since || !(stamp >= s.since->stamp()) || !std::isfinite(stamp)) return std::nullopt;
  // The last input before the moment also holds at it.
  constexpr double kRecent = 0.02;  // [s]
  const auto pieces = s.inputs.between(stamp - kRecent, stamp, s.since->measured());
  if (pieces.empty()) return std::nullopt;  // a number so large that it tells no moments apart
  s.since->predict(stamp, s.inputs, s.noise);
  const MotionState& body = s.since->state();
  const Twist twist = twist_of(body, pieces.back());
  const Pose T_sensor_body = s.inputs.T_sensor_body();
  const Eigen::Matrix3d R = T_sensor_body.rotation.toRotationMatrix();
  const Eigen::Vector3d sensor_in_body = T_sensor_body.inverse().translation;
  return SensorMotion{.stamp = stamp,
                      .T_map_sensor = s.since->pose(),
                      .covariance = published_covariance(*s.since),
                      .twist = {.linear = R * (twist.linear + twist.angular.cross(sensor_in_body)),
                                .angular = R * twist.angular}};
}

Result<void> Localizer::add(const ImuSample& sample) { return state_->inputs.add(sample); }
Result<void> Localizer::add(const OdometrySample& sample) { return state_->inputs.add(sample); }

}  // namespace vantage
