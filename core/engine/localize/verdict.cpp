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

/// The probability that a pose with these deviations is beyond the limit from another pose.
/// @param metres, radians  between the pose and the other one
double beyond(const AlertLimit& limit, const PoseConfidence& confidence, double metres,
              double radians) {
  if (metres >= limit.metres || radians >= limit.radians) return 1.0;
  return std::min(1.0, beyond(limit.metres - metres, confidence.sigma_translation[0]) +
                           beyond(limit.radians - radians, confidence.sigma_rotation[0]));
}

/// The covariance of a pose. Errors of the map and of the place repeat from scan to scan; the
/// filter takes them for new at every scan, and averages them away.
PoseMatrix published(const MotionFilter& motion) {
  constexpr double kRepeated = 1.5;  // chosen on the recorded street
  return kRepeated * motion.pose_covariance();
}

}  // namespace

MotionFilter Verdict::conclude(const std::vector<Hypothesis>& hypotheses, const Known& known,
                               const MotionInputs& inputs, const MotionNoise& noise,
                               ScanReport& report) {
  const Hypothesis& best = hypotheses.front();
  constexpr double kFirm = 0.2;  // share of sharpness that says where an adrift sensor is
  report.alignment = best.alignment;
  if (best.alignment) {
    const double fitness = best.alignment->score.fitness;
    report.lcp = localization_contribution_per_point(fitness, report.map_points);
  }
  // The pose of a scan that does not fit is where the motion led, not where matching pulled it.
  const bool fits = best.fits();
  if (best.initial) adrift_ = false;  // the sensor was found anew
  if (!fits) adrift_ = true;
  if (fits && best.evidence && best.evidence->share >= kFirm) adrift_ = false;
  MotionFilter motion = best.moved();
  // A pose at the stamp is as sure as the speed that leads to it from the middle of the sweep.
  report.confidence = confidence_of(published(motion.at(report.stamp, inputs, noise)));
  double place = known.elsewhere;
  for (std::size_t h = 1; h < hypotheses.size(); ++h) {
    const MotionFilter other = hypotheses[h].moved();
    const Pose reported = motion.pose(), there = other.pose();
    place += known.beliefs[h] * beyond(limit_, confidence_of(published(other)),
                                       (reported.translation - there.translation).norm(),
                                       rotation_between(reported, there));
  }
  report.risk =
      std::min(1.0, place + known.beliefs.front() * beyond(limit_, *report.confidence, 0.0, 0.0));
  if (!known.compared) report.risk = std::max(report.risk, kAlike);
  if (adrift_) report.risk = std::max(report.risk, kAdrift);
  judge(best, known, place, report);
  if (!limit(best, report)) motion = *best.motion;
  if (report.tracking == Tracking::tracked) {
    report.recovered = std::exchange(was_lost_, false);
  } else {
    was_lost_ = was_lost_ || report.tracking == Tracking::lost;
  }
  return motion;
}

void Verdict::judge(const Hypothesis& best, const Known& known, double place,
                    ScanReport& report) const {
  constexpr const char* kDoesNotFit = "the scan does not fit the map here";
  const auto conclude = [&](Tracking tracking, const std::string& reason) {
    report.tracking = tracking;
    report.reason = reason;
  };
  if (report.scan_points == 0) return conclude(Tracking::uncertain, "the scan has no points");
  if (!best.alignment) return conclude(Tracking::lost, best.failure);
  if (known.elsewhere > kLost) {
    // On an open square, a scan fits as well a few metres beside its pose.
    return known.scores_as_usual
               ? conclude(Tracking::uncertain, "the scan fits the map as well beside this pose")
               : conclude(Tracking::lost, kDoesNotFit);
  }
  if (!best.fits()) return conclude(Tracking::uncertain, kDoesNotFit);
  const bool settled = known.compared && !adrift_;
  if (settled && report.risk <= params_.max_risk) return conclude(Tracking::tracked, "");
  if (place > params_.max_risk || !known.compared) {
    return conclude(Tracking::uncertain, "other poses are not ruled out yet");
  }
  constexpr double kKnownSpeed = 1.0;  // [m/s]
  const double speed = best.motion->covariance().diagonal().segment<3>(6).maxCoeff();
  conclude(Tracking::uncertain,
           speed > kKnownSpeed * kKnownSpeed
               ? "the speed of the sensor is not known yet"
               : "the scan leaves open where along one direction the sensor is");
}

bool Verdict::limit(const Hypothesis& best, ScanReport& report) const {
  if (report.tracking == Tracking::lost || !best.alignment) return true;
  const ScanScore& score = best.alignment->score;
  if (params_.min_coverage && score.coverage < *params_.min_coverage) {
    report.reason = "coverage " + std::to_string(score.coverage) + " below min_coverage";
  } else if (params_.min_nvtl && score.nvtl < *params_.min_nvtl) {
    report.reason = "NVTL " + std::to_string(score.nvtl) + " below min_nvtl";
  } else if (params_.max_correction && best.sigma() < *params_.max_correction &&
             !(best.correction() <= *params_.max_correction)) {
    report.reason = "matching moved the scan by " + std::to_string(best.correction()) +
                    " m, more than max_correction";
  } else {
    return true;
  }
  report.tracking = Tracking::lost;
  return false;
}

void Verdict::forget(bool lost) {
  was_lost_ = lost;
  adrift_ = false;
}

}  // namespace vantage
