#include "localize/verdict.hpp"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <string>
#include <utility>

#include "vantage/engine/confidence.hpp"

namespace vantage {
namespace {

// A scan is lost if the sensor is probably at none of the poses that are followed, unless the scan
// scores as usual.
constexpr double kLost = 0.5;
// The probability of a place that looks alike, as long as nobody has looked for one.
constexpr double kAlike = 0.05;
// At least the probability that a pose is off that only motion carries on: before a scan ceases to
// fit, the scans before it may have led astray.
constexpr double kAdrift = 0.05;

/// Two-sided tail of the normal distribution beyond `limit` for a standard deviation `sigma`.
double beyond(double limit, double sigma) {
  return sigma > 0.0 ? std::erfc(limit / (sigma * std::numbers::sqrt2)) : 0.0;
}

}  // namespace

void Verdict::conclude(const Hypothesis& best, const Known& known, ScanReport& report) {
  report.T_map_scan_predicted = best.predicted;
  report.T_map_scan = best.pose();
  report.alignment = best.alignment;
  if (best.alignment) {
    const double fitness = best.alignment->score.fitness;
    report.lcp = localization_contribution_per_point(fitness, report.map_points);
    report.confidence = confidence_of(*best.alignment, params_.covariance_scale);
  }
  // The pose of a scan that does not fit is where the motion led, not where matching pulled it.
  const bool fits = best.fits();
  if (!fits) report.T_map_scan = best.predicted;
  report.risk = std::min(1.0, 1.0 - known.belief + imprecision(best, fits, report));
  if (!known.compared) report.risk = std::max(report.risk, kAlike);
  if (adrift_) report.risk = std::max(report.risk, kAdrift);
  judge(best, fits, known, report);
  limit(best, report);
  if (report.tracking == Tracking::tracked) {
    report.recovered = std::exchange(was_lost_, false);
  } else {
    was_lost_ = was_lost_ || report.tracking == Tracking::lost;
  }
}

void Verdict::judge(const Hypothesis& best, bool fits, const Known& known,
                    ScanReport& report) const {
  constexpr const char* kDoesNotFit = "the scan does not fit the map here";
  const auto conclude = [&](Tracking tracking, const std::string& reason) {
    report.tracking = tracking;
    report.reason = reason;
  };
  if (!best.alignment) return conclude(Tracking::lost, best.failure);
  if (known.elsewhere > kLost) {
    // On an open square, a scan fits as well a few metres beside its pose.
    return known.scores_as_usual
               ? conclude(Tracking::uncertain, "the scan fits the map as well beside this pose")
               : conclude(Tracking::lost, kDoesNotFit);
  }
  if (!fits) return conclude(Tracking::uncertain, kDoesNotFit);
  if (report.risk <= params_.max_risk) return conclude(Tracking::tracked, "");
  conclude(Tracking::uncertain,
           1.0 - known.belief > params_.max_risk || !known.compared
               ? "other poses are not excluded yet"
               : "the scan leaves open where along one direction the sensor is");
}

void Verdict::Drift::coasts(double seconds, double acceleration) noexcept {
  of_speed = std::hypot(of_speed, acceleration * seconds);
  sigma += of_speed * seconds;  // the error of a speed keeps its sign
}

void Verdict::Drift::measured(double by_scan, double before, double seconds) noexcept {
  if (by_scan >= sigma) return;
  sigma = by_scan;
  of_speed = std::min(of_speed, (before + by_scan) / seconds);
}

double Verdict::imprecision(const Hypothesis& best, bool fits, const ScanReport& report) {
  // The error of the last pose grows with the way or, without odometry, with time; where the scan
  // says more, its own error counts.
  constexpr double kDriftMetres = 0.02, kDriftRadians = 0.002;  // per metre, with odometry
  // Of a sensor whose speed is not known yet [m/s, rad/s], and without odometry [m/s^2, rad/s^2].
  constexpr double kSpeed = 3.0, kTurn = 0.5, kAcceleration = 1.0, kTurnAcceleration = 0.2;
  constexpr double kFirm = 0.2;  // share of sharpness that says where an adrift sensor is
  if (!fits) adrift_ = true;
  if (fits && best.evidence && best.evidence->share >= kFirm) adrift_ = false;
  const double seconds = report.stamp - std::exchange(stamp_, report.stamp);
  if (best.initial) {  // the sensor was found anew
    metres_ = radians_ = {};
    adrift_ = !fits;
  }
  if (metres_.sigma > 0.0) {
    const Drift metres = metres_, radians = radians_;
    if (best.motion.has_odometry()) {
      const auto step = best.motion.step();
      const double way = step ? step->T_now_later.translation.norm() : 0.0;
      metres_.sigma = std::hypot(metres_.sigma, kDriftMetres * way);
      radians_.sigma = std::hypot(radians_.sigma, kDriftRadians * way);
    } else {
      metres_.coasts(seconds, kAcceleration);
      radians_.coasts(seconds, kTurnAcceleration);
    }
    if (!adrift_) {
      metres_.measured(report.confidence->sigma_translation[0], metres.sigma, seconds);
      radians_.measured(report.confidence->sigma_rotation[0], radians.sigma, seconds);
    }
  } else if (fits) {
    metres_ = {report.confidence->sigma_translation[0], kSpeed};
    radians_ = {report.confidence->sigma_rotation[0], kTurn};
  }
  const double limit_rad = params_.alert_limit_deg * std::numbers::pi / 180.0;
  return beyond(params_.alert_limit, metres_.sigma) + beyond(limit_rad, radians_.sigma);
}

void Verdict::limit(const Hypothesis& best, ScanReport& report) const {
  if (report.tracking == Tracking::lost) return;
  const ScanScore& score = best.alignment->score;
  if (params_.min_coverage && score.coverage < *params_.min_coverage) {
    report.reason = "coverage " + std::to_string(score.coverage) + " below min_coverage";
  } else if (params_.min_nvtl && score.nvtl < *params_.min_nvtl) {
    report.reason = "NVTL " + std::to_string(score.nvtl) + " below min_nvtl";
  } else if (params_.max_correction && best.motion.step() &&
             !(best.correction() <= *params_.max_correction)) {
    report.reason = "matching moved the scan by " + std::to_string(best.correction()) +
                    " m, more than max_correction";
  } else {
    return;
  }
  report.tracking = Tracking::lost;
  report.T_map_scan = best.predicted;
}

void Verdict::forget(bool lost) {
  was_lost_ = lost;
  metres_ = radians_ = {};
  adrift_ = false;
}

}  // namespace vantage
